"""Home in small windows, with an alarm and a question of a robot that talks too much: nothing overlaps, and what matters is reached."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import timedelta
from itertools import pairwise, product
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from kivy.core.window import Window
from kivy.metrics import Metrics
from kivy.tests.common import UnitTestTouch
from kivy.uix.label import Label
from kivy.uix.scrollview import ScrollView
from kivy.uix.widget import Widget

from app.domain.models import Alarm, Connection, Group, Priority
from app.domain.problems import in_words
from app.domain.robot import RobotProblem, UserPrompt
from app.i18n import _, translator
from app.screens.common.pin_dialog import PinDialog
from app.screens.frame.facts import OpenIssues
from app.screens.home.cards import (
    Answers,
    HomeColumn,
    HomeTall,
    MissionTile,
    PlaceMap,
    PromptOption,
    QueueCard,
    RobotCard,
    RobotControls,
)
from app.screens.home.fleet_page import Counts
from app.screens.home.screen import HomeScreen
from app.services.live.holds import Hold
from app.widgets import load_kv
from app.widgets.buttons import CommandButton
from app.widgets.display import ValueTile
from app.widgets.frame import AlarmBanner, Frame
from app.widgets.number_pad import PadKey
from app.widgets.panel_grid import PanelGrid
from app.widgets.rows import RobotChip
from app.widgets.text import Title
from app.widgets.tokens import tk
from tests.screenshots.fleet import fleet
from tests.screenshots.home import ALARMS, ERROR, QUESTION, SILENT, home, stopped
from tests.screenshots.planning import Stand
from tests.support import home_facts as sample
from tests.ui import checks

WAYS = (*product(((800, 480), (600, 480)), ("plain", "gloves", "large")),
        ((1024, 600), "gloves"), ((1024, 600), "large"), ((600, 1024), "large"), ((1280, 800), "plain"))
LOUD = tuple(RobotProblem(n, f"{n} wheel motor {'x' * 100} needs service at once") for n in range(900))
ALARM = OpenIssues((
    Alarm("robot_error", "robot:1", Priority.HIGH, sample.ago(minutes=2), {"robot": "Aino", "problem": in_words(LOUD)}, id=1),
    *(Alarm("unreachable", f"robot:{n}", Priority.MEDIUM, sample.ago(minutes=9), {"robot": "Veikko"}, id=n) for n in range(2, 12))))
ASKING = replace(sample.ASKING, user_prompt=UserPrompt("p1", "Is the aisle between the warehouse and production line 2 free? " * 50, tuple(
    f"Door {n} with a rather long name for a door of a plant, on the {side} side" for n, side in enumerate(("left", "right", "far")))))


class Rig:
    """What tests/screenshots/home.py asks of a studio."""

    def __init__(self, ui) -> None:
        self.dialogs, self._ui, self.driver = None, ui, ui
        self.after: list[Callable[[], object]] = []

    def afterwards(self, close: Callable[[], object]) -> None:
        self.after.append(close)

    def directory(self) -> Path:
        made = TemporaryDirectory(prefix="amr-pictures-")
        self.after.append(made.cleanup)
        return Path(made.name)

    def close(self) -> None:
        """The last one first."""
        while self.after:
            self.after.pop()()

    def show(self, widget: Widget) -> None:
        self._ui.show(widget)


@pytest.fixture(params=[pytest.param(way, id="{0[0]}x{0[1]}-{1}".format(*way)) for way in WAYS])
def small(ui, request) -> Iterator[Rig]:
    """A window of one of these sizes, some with gloves, some with large texts."""
    size, mode = request.param
    before = Window.size
    Window.size = size
    Metrics.fontscale = 1.3 if mode == "large" else 1.0
    tk.use("light", gloves=mode == "gloves")
    translator.use("fi" if mode == "large" else "en")          # Finnish words are the longer ones
    rig = Rig(ui)
    yield rig
    rig.close()
    Metrics.fontscale = 1.0
    Window.size = before


def loud_home(ui, rig: Rig, status=ASKING) -> HomeScreen:
    screen = home(rig, sample.with_aino(status), issues=ALARM)
    ui.advance(.5)
    return screen


def reach(ui, widget: Widget) -> None:
    """Scroll what is around ``widget``; all of it must then be seen, in the window's part for screens."""
    for view in checks.parents(widget):
        if isinstance(view, ScrollView) and view.do_scroll_y:
            view.scroll_to(widget, padding=0, animate=False)
            ui.advance()
    whole, seen = checks.area(widget), checks.visible_area(widget, checks.parents(widget))
    left, bottom, right, top = checks.area(ui.find(Frame).ids.body)
    assert seen == pytest.approx(whole, abs=2), f"{checks.name_of(widget)} can't be reached"
    assert left - 2 <= whole[0] <= whole[2] <= right + 2
    assert bottom - 2 <= whole[1] <= whole[3] <= top + 2


def test_nothing_overlaps(ui, small):
    loud_home(ui, small)
    assert "\n".join(checks.problems(ui.find(Frame))) == ""
    banner = ui.find(AlarmBanner)
    lines = sum(label.lines for label in (banner.ids.banner_text, banner.ids.banner_note) if label.height > 1)
    assert lines <= 3
    assert banner.ids.banner_note.height > 1
    assert banner.ids.banner_text.texture_size[0] > 200
    assert banner.height <= Window.height / 3


def test_the_state_and_all_controls_can_be_reached(ui, small):
    loud_home(ui, small, replace(sample.FAILED, errors=LOUD))
    view = ui.find(HomeScreen).vm
    reach(ui, next(label for label in ui.find_all(Label) if label.text == view.card.state))
    for word in (view.controls.pause, _("Reset errors"), _("Clear queue")):
        reach(ui, ui.find(CommandButton, text=word))
    reach(ui, ui.find(CommandButton, text=view.run.text))


@pytest.mark.parametrize("small", [pytest.param(((1024, 600), "large"), id="1024x600-large")], indirect=True)
@pytest.mark.parametrize("issues", [None, OpenIssues([ALARM.alarms[1]])])
def test_the_controls_are_seen_at_once(ui, small, issues):
    screen = home(small, sample.FACTS, issues=issues)
    ui.advance(.5)
    for word in (screen.vm.controls.pause, _("Reset errors"), _("Clear queue")):
        button = ui.find(CommandButton, text=word)
        assert checks.visible_area(button, checks.parents(button)) == pytest.approx(checks.area(button), abs=1)
    assert "\n".join(checks.problems(ui.find(Frame))) == ""


@pytest.mark.parametrize("small", [pytest.param(((1024, 600), mode), id=f"1024x600-{mode}") for mode in ("plain", "gloves")], indirect=True)
def test_each_of_three_robots_is_seen_whole(ui, small):
    home(small, sample.FACTS)
    ui.advance(.5)
    chips = ui.find_all(RobotChip)
    assert len(chips) == 3
    for chip in chips:
        assert checks.visible_area(chip, checks.parents(chip)) == pytest.approx(checks.area(chip), abs=1)


@pytest.mark.parametrize("small", [pytest.param(((1024, 600), "large"), id="1024x600-large")], indirect=True)
def test_the_heading_of_the_schedules_is_on_one_line(ui, small):
    stand = Stand(small, "scheduler")
    stand.vm.choose_part("schedules")
    stand.settle()
    heading = next(label for label in ui.find_all(Title) if label.text == _("Schedules"))
    assert heading.lines == 1


@pytest.mark.parametrize(("facts", "alarm"), [
    pytest.param(sample.with_aino(sample.FAILED), ERROR, id="failed"),
    pytest.param(sample.with_aino(sample.EXECUTING, age=250, connection=Connection.UNREACHABLE), SILENT, id="silent")])
def test_of_a_robot_that_somebody_has_to_go_to_all_that_is_needed_is_seen_at_once(ui, facts, alarm):
    """1280×800 with an alarm: what it says, its battery, where it is or was, and its controls."""
    screen = home(Rig(ui), facts, issues=OpenIssues([alarm]))
    ui.advance(.5)
    told = ui.find(MissionTile), ui.find(ValueTile, icon=screen.vm.card.battery.icon), ui.find(PlaceMap), ui.find(RobotControls)
    for part in told:
        assert checks.visible_area(part, checks.parents(part)) == pytest.approx(checks.area(part), abs=1), part
    assert ui.find(PlaceMap).height >= 150
    assert ui.find(MissionTile).height < 110              # what room there is, is the map's
    bands = sorted(checks.area(part)[1::2] for part in told)
    assert all(above - below <= 24 for (_bottom, below), (above, _top) in pairwise(bands))      # no gap
    assert "\n".join(checks.problems(ui.find(Frame))) == ""
    screen.vm.take(sample.FACTS)
    ui.advance(.5)
    assert ui.find(ValueTile, label=_("Done about"))
    assert "\n".join(checks.problems(ui.find(Frame))) == ""


@pytest.mark.parametrize("status", [sample.READY, sample.CHARGING])
def test_the_map_of_a_robot_on_which_nothing_runs_is_beside_its_battery_below_a_banner(ui, status):
    """Without one it is below, and the address is beside the battery."""
    facts = sample.with_aino(status, queue=())
    home(Rig(ui), facts)
    ui.advance(.5)
    assert not ui.find(RobotCard).has_map_beside
    screen = home(Rig(ui), facts, issues=HELD)
    ui.advance(.5)
    assert ui.find(RobotCard).has_map_beside
    place, battery = ui.find(PlaceMap), ui.find(ValueTile, icon=screen.vm.card.battery.icon)
    (left, low, _right, high), (_left, bottom, right, top) = checks.area(place), checks.area(battery)
    assert (left >= right, bottom < high, low < top) == (True, True, True)
    assert checks.visible_area(place, checks.parents(place)) == pytest.approx(checks.area(place), abs=1)
    assert "\n".join(checks.problems(ui.find(Frame))) == ""


def test_what_a_robot_says_stands_there_once(ui):
    sentence = home(Rig(ui), sample.with_aino(sample.FAILED), issues=OpenIssues([ERROR])).vm.card.mission.name
    ui.advance(.5)
    assert [label.text for label in ui.find_all(Label) if sentence in label.text] == [sentence]


def test_a_map_is_not_cut_where_the_page_ends(ui, small):
    loud_home(ui, small, sample.EXECUTING)
    for plan in ui.find_all(PlaceMap):
        seen = checks.visible_area(plan, checks.parents(plan))
        shown = seen[3] - seen[1] if seen else 0
        page = any(isinstance(view, HomeColumn | HomeTall) for view in checks.parents(plan))       # scrolls as a whole
        assert page or shown <= 1 or shown >= plan.height - 1


@pytest.mark.parametrize("issues", [OpenIssues(), None], ids=["well", "banner"])
def test_some_tiles_are_seen_below_the_counts_of_all_robots(ui, small, issues):
    page = fleet(small, 12, issues=issues)
    ui.advance(.5)
    assert page.is_shown
    head, tiles = ui.find(Counts), ui.find(PanelGrid)
    assert head.to_window(0, head.top)[1] <= ui.find(Frame).ids.body.to_window(0, ui.find(Frame).ids.body.top)[1] + 1
    assert tiles.height >= 40


def test_the_words_of_a_robot_without_a_map_can_be_reached(ui, small):
    home(small, replace(sample.with_aino(sample.EXECUTING), map=None))
    ui.advance(.5)
    reach(ui, next(label for label in ui.find_all(Label) if label.text == sample.EXECUTING.mission_text))


def test_a_question_and_each_answer_can_be_reached(ui, small):
    view = loud_home(ui, small).vm
    answers = ui.find_all(PromptOption)
    assert len(answers) == 3
    for answer in answers:
        reach(ui, answer)
        label = next(widget for widget in answer.walk() if isinstance(widget, Label) and widget.text == answer.text)
        assert label.height <= answer.height
    reach(ui, next(label for label in ui.find_all(Label) if label.text == view.prompt.question))


def is_seen(widget: Widget) -> bool:
    """All of it, without scrolling."""
    seen = checks.visible_area(widget, checks.parents(widget))
    return seen is not None and seen == pytest.approx(checks.area(widget), abs=1)


@pytest.fixture(params=["small", "small-large-text", "small-gloves", "large-text", "gloves"])
def usual(ui, request) -> Iterator[Rig]:
    """A usual window, with texts and banner as long as most are."""
    before, mode = Window.size, request.param
    Window.size = (1024, 600) if "small" in mode else (1280, 800)
    Metrics.fontscale = 1.3 if "large" in mode else 1.0
    tk.use("light", gloves="gloves" in mode)
    rig = Rig(ui)
    yield rig
    rig.close()
    Metrics.fontscale = 1.0
    tk.use("light")
    Window.size = before


@pytest.mark.parametrize("minutes", [1, 20])
def test_the_answers_are_seen_without_scrolling(ui, usual, minutes):
    """Also when nobody has acknowledged that it asks."""
    home(usual, sample.with_aino(sample.ASKING), issues=OpenIssues([replace(QUESTION, raised_at=sample.ago(minutes=minutes))]))
    ui.advance(.5)
    assert ui.find(AlarmBanner).urgent == (minutes > 5)
    answers = ui.find_all(PromptOption)
    assert [answer.text for answer in answers if is_seen(answer)] == list(sample.ASKING.user_prompt.options)


def test_what_to_do_at_an_emergency_stop_is_seen_without_scrolling(ui, usual):
    screen = home(usual, stopped(), issues=OpenIssues(ALARMS))
    ui.advance(.5)
    assert is_seen(next(label for label in ui.find_all(Label) if label.text == screen.vm.card.mission.name))


def test_every_key_of_the_pin_is_seen_without_scrolling(ui, small):
    dialog = PinDialog(title="Settings", text="Enter the PIN of this tablet")
    dialog.open()
    ui.advance(.5)
    for key in ui.find_all(PadKey):
        assert checks.visible_area(key, checks.parents(key)) == pytest.approx(checks.area(key), abs=1)
    assert "\n".join(checks.problems(dialog)) == ""
    dialog.dismiss()
    ui.advance(.5)


@pytest.mark.parametrize("size", [(800, 480), (600, 480)])
def test_a_drag_over_a_list_that_fits_scrolls_the_page(ui, size):
    before = Window.size
    Window.size = size
    try:
        home(Rig(ui), replace(sample.with_aino(sample.READY, ()), open=()), issues=ALARM)
        ui.advance(.5)
        words = ui.find(text=ui.find(HomeScreen).vm.queue_empty, root=ui.find(QueueCard))
        reach(ui, words)
        page = next(parent for parent in checks.parents(words) if isinstance(parent, ScrollView))
        at = page.scroll_y
        ui.drag(words, 0, 150 if at > .5 else -150)
        assert page.scroll_y != pytest.approx(at)
    finally:
        Window.size = before


def test_a_tap_on_the_text_of_the_banner_leads_to_the_list(ui):
    frame = Frame(alarm="Aino is stopped", alarm_note="Since 14:36")
    ui.show(frame)
    asked = []
    frame.bind(on_list_alarms=lambda *_args: asked.append("list"))
    ui.tap_text("Aino is stopped")
    assert asked == ["list"]


# ---------------------------------------------------------------------- answers
def rows_of_answers(ui, width: float, *options: str) -> list[list[str]]:
    """By the row they are in."""
    load_kv("home/cards")
    answers = ui.show(Answers(options=list(options), spacing=8), (width, 400))
    rows: dict[float, list[str]] = {}
    for button in reversed(answers.children):
        rows.setdefault(button.top, []).append(button.text)
    return list(rows.values())


@pytest.mark.parametrize(("width", "options", "rows"), [
    (360, ("Yes", "No", "Skip this stop"), [["Yes", "No", "Skip this stop"]]),
    (360, ("Door 1, left", "Door 1, right", "Door 2, left", "Door 2, right"),
     [["Door 1, left", "Door 1, right"], ["Door 2, left", "Door 2, right"]]),
    (360, ("Yes", "A long answer for which one line is too short"), [["Yes"], ["A long answer for which one line is too short"]]),
    (360, ("Yes", "Yes"), [["Yes", "Yes"]]),
])
def test_answers_share_a_row_where_they_fit(ui, width, options, rows):
    assert rows_of_answers(ui, width, *options) == rows


def test_an_answer_is_sent_once(ui):
    load_kv("home/cards")
    answers = ui.show(Answers(options=["Yes", "No"], spacing=8), (360, 100))
    sent = []
    answers.bind(on_answer=lambda _answers, option: sent.append(option))
    ui.tap(ui.find(PromptOption, text="No"))
    answers.busy = True
    ui.tap(ui.find(PromptOption, text="Yes"))
    assert sent == ["No"]


# ---------------------------------------------------------------------- fingers
HELD = OpenIssues(holds=(Hold("Maintenance", sample.NOW + timedelta(minutes=38), sample.ago(minutes=22), robot_id=1),))
IDLE = replace(sample.with_aino(sample.READY), groups=(Group("Hall 1", (1, 2), id=5), Group("Pallet pair", (1, 3), id=6)))


def swipe(ui, x: float, y: float, dy: float) -> None:
    """Drag from that point of the window."""
    touch = UnitTestTouch(x, y)
    touch.touch_down()
    ui.advance()
    for n in range(1, 11):
        touch.touch_move(x, y + dy * n / 10)
        ui.advance()
    ui.advance(.3)
    touch.touch_up()
    ui.advance(.5)


@pytest.mark.parametrize("small", [pytest.param((size, "large"), id=f"{size[0]}x{size[1]}") for size in ((600, 800), (1024, 600))],
                         indirect=True)
def test_drags_lead_from_whatever_is_under_the_finger_to_the_run_button(ui, small):
    screen = home(small, IDLE, issues=HELD)
    screen.vm.choose_target(("group", 5))
    ui.advance(.5)
    button = ui.find(CommandButton, text=screen.vm.run.text)
    left, bottom, right, top = checks.area(ui.find(Frame).ids.body)
    x, y = (left + right) / 2 if Window.width < Window.height else right - 100, (bottom + top) / 2
    for _n in range(30):
        if checks.visible_area(button, checks.parents(button)) == pytest.approx(checks.area(button), abs=2):
            return
        swipe(ui, x, y, 80)
    pytest.fail("the Run button is not reached")


@pytest.mark.parametrize("small", [pytest.param(((600, 800), "plain"), id="600x800")], indirect=True)
def test_the_robots_card_is_as_high_as_it_needs_in_one_column(ui, small):
    home(small, IDLE, issues=HELD)
    ui.advance(.5)
    card, tile = ui.find(RobotCard), ui.find(MissionTile)
    assert not card.ids.scroll.do_scroll_y
    assert tile.height < 130
    page = ui.find(HomeColumn)
    swipe(ui, *tile.to_window(*tile.center), 100)
    assert page.scroll_y < 1
