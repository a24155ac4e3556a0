"""How many touches the usual tasks take, and how many words the pages have."""

from __future__ import annotations

from datetime import time

import pytest

from app.domain.models import Between
from app.i18n import translator
from app.screens.scheduler.cards import FormFold, FormSheet, PlanPage
from app.screens.scheduler.draft import Kind
from app.widgets.buttons import ChoiceChip, CommandButton, Segment
from app.widgets.choices import OptionRow
from app.widgets.items import Option
from app.widgets.pickers import TimeCell
from tests.ui import looks
from tests.ui.planner import KITS, field, new, press, reveal, settle, tab


class Hand:
    """Taps, and counts them; scrolling is none."""

    def __init__(self, app, ui) -> None:
        self._app, self._ui, self.taps = app, ui, 0

    def tap(self, kind, root=None, **values) -> None:
        widget = self._ui.find(kind, root, **values)
        if root is not None and isinstance(root, FormSheet) and widget.get_parent_window():
            reveal(self._ui, widget)
        self._ui.advance(0.5)
        self._ui.tap(widget)
        self.taps += 1
        settle(self._app, self._ui)

    def tap_field(self, label: str) -> None:
        self._ui.tap(field(self._ui, label))
        self.taps += 1
        settle(self._app, self._ui)


@pytest.fixture
def hand(screen, ui) -> Hand:
    return Hand(screen, ui)


def begin(hand, ui) -> FormSheet:
    hand.tap(CommandButton, ui.find(PlanPage), text="New")
    hand.tap(OptionRow, title=KITS)
    return ui.find(FormSheet)


def test_on_weekdays_at_half_past_six_with_another_battery_takes_nine(screen, container, ui, hand):
    known = {schedule.id for schedule in container.catalogue.schedules()}
    sheet = begin(hand, ui)
    hand.tap(Segment, sheet, text="Weekly")
    hand.tap_field("Time")
    hand.tap(TimeCell, text="06")
    hand.tap(TimeCell, text="30")
    hand.tap(FormFold)
    hand.tap(ChoiceChip, ui.find(FormSheet), text="40 %")
    hand.tap(CommandButton, text="Save")
    [made] = [schedule for schedule in container.catalogue.schedules() if schedule.id not in known]
    assert (made.recurrence, made.start.time(), made.minimum_battery_percent) == (
        "FREQ=WEEKLY;BYDAY=MO,TU,WE,TH,FR",
        time(6, 30),
        40,
    )
    assert hand.taps <= 9


def test_every_half_hour_from_eight_to_four_takes_eight(screen, container, ui, hand):
    known = {schedule.id for schedule in container.catalogue.schedules()}
    sheet = begin(hand, ui)
    hand.tap(Segment, sheet, text="More")
    hand.tap_field("To")
    hand.tap(TimeCell, text="16")
    minutes = [cell for cell in ui.find_all(TimeCell) if cell.text == "00"]
    ui.tap(minutes[-1])
    hand.taps += 1
    settle(screen, ui)
    hand.tap(CommandButton, text="Save")
    [made] = [schedule for schedule in container.catalogue.schedules() if schedule.id not in known]
    assert made.recurrence.startswith("FREQ=MINUTELY;INTERVAL=30")
    assert made.between == Between(time(8), time(16))
    assert hand.taps <= 8


@pytest.fixture(params=["en", "fi"])
def language(request, screen, ui):
    translator.use(request.param)
    settle(screen, ui)
    yield request.param
    translator.use("en")
    settle(screen, ui)


def test_the_pages_have_few_words_and_one_filled_button(screen, ui, language):
    for key, most in (("plan", 90), ("schedules", 95), ("suggestions", 95)):
        tab(screen, ui, key)
        assert len(looks.words(screen.root)) <= most, key
        assert len(looks.filled(screen.root)) <= 1
        assert looks.scrolls(screen.root) == []


def test_beside_a_sheet_the_page_has_no_filled_button(screen, ui):
    press(screen, ui, "Hold")
    assert looks.filled(screen.root) == ["Hold"]
    screen.shell.sheets.close(screen.shell.sheets.top)
    assert looks.filled(screen.root) == ["New"]
    options = [Option(n, str(n)) for n in range(3)]
    screen.shell.dialogs.choose_many("Robots", options, "Show", print)
    settle(screen, ui)
    assert looks.filled(screen.root) == ["Show"]
    screen.shell.dialogs.close_all()


def test_the_form_has_few_words_and_one_filled_button(screen, container, ui, language):
    new(screen, ui)
    kits = next(mission.id for mission in container.catalogue.missions() if mission.name == KITS)
    screen.plan.form.set(mission_id=kits, kind=Kind.WEEKLY)
    settle(screen, ui)
    assert len(looks.words(screen.root)) <= 110
    assert len(looks.filled(screen.root)) == 1
    assert looks.sizes(screen.root) <= looks.SIZES
    assert looks.targets(screen.root) == []
