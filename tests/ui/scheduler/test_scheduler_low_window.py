"""The Scheduler in a low window: going between plan, form and schedules, which are shown one at a time."""

from __future__ import annotations

import pytest
from kivy.metrics import dp

from app.screens.common.shell import pick
from app.screens.scheduler.cards import FormCard, SchedulesCard, UpcomingCard
from app.screens.scheduler.screen import SchedulerScreen
from app.widgets.buttons import CommandButton, Segment, Toggle
from app.widgets.long_list import LongList
from app.widgets.plan_rows import DayLine, ScheduleLine
from app.widgets.timeline import Timeline
from app.widgets.timeline_painting import AXIS
from tests.ui import checks
from tests.ui.planner import KITS, choose, kind, named, save, schedules, settle

pytestmark = pytest.mark.long


@pytest.fixture
def low(screen, container, ui):
    """The screen of the app in a low window."""
    screen.shell.go("home")
    low = ui.show(SchedulerScreen(pick(SchedulerScreen.Services, container), screen.shell), (976, 440))
    low.shown()
    yield low
    low.hidden()
    ui.show(screen.root)


def test_a_start_of_the_list_is_edited_and_saving_leads_back(low, screen, ui):
    settle(screen, ui)
    kind(screen, ui, "List")
    assert not ui.find_all(FormCard)
    start = next(line for line in ui.find_all(DayLine) if line.mission)
    ui.tap(start)
    settle(screen, ui)
    assert ui.find(FormCard).view.mission == start.mission
    save(screen, ui)
    assert not ui.find_all(FormCard)
    assert ui.find_all(DayLine)


def test_fields_and_lists_of_a_low_window_take_taps(low, screen, container, ui):
    settle(screen, ui)
    ui.tap(ui.find(Segment, text="New schedule"))
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Daily")
    assert low.vm.form.draft.kind == "daily"
    ui.tap(ui.find(Segment, text="Schedules"))
    settle(screen, ui)
    line = ui.find_all(ScheduleLine)[0]
    number = line.key
    ui.tap(ui.find(Toggle, line))
    settle(screen, ui)
    assert not container.repositories.schedules.get(container.db.read(), number).enabled
    assert ui.find_all(ScheduleLine)[0].key == number  # it stays under the finger
    ui.tap(ui.find(Segment, text="Timeline"))
    ui.tap(ui.find(Segment, text="Schedules"))
    settle(screen, ui)
    first = ui.find_all(ScheduleLine)[0].key
    assert first != number  # read again: what is off is at the end
    ui.advance(1)  # a tap at once would be meant for the row that stood there
    line = ui.find(ScheduleLine, key=first)
    ui.tap_at(*line.to_window(line.center_x - 40, line.center_y))
    settle(screen, ui)
    assert low.vm.form.editing == first
    assert ui.find(FormCard).view.title == "Edit schedule"


def test_a_window_that_becomes_high_has_all_of_it_again(low, screen, ui):
    settle(screen, ui)
    kind(screen, ui, "Schedules")
    low.size = 1232, 640
    settle(screen, ui)
    assert [bool(ui.find_all(part)) for part in (UpcomingCard, FormCard, SchedulesCard)] == [True] * 3
    low.size = 976, 440
    settle(screen, ui)
    assert [bool(ui.find_all(part)) for part in (UpcomingCard, FormCard, SchedulesCard)] == [False, False, True]


@pytest.mark.parametrize(
    "size",
    [(1232, 552), (1080, 552), (976, 440), (976, 352)],
    ids=["1280×800 with a banner", "narrower", "1024×600", "and with a banner"],
)
def test_save_and_skip_are_in_sight_as_soon_as_a_schedule_is_edited(low, screen, container, ui, size):
    low.size = size
    settle(screen, ui)
    low.vm.edit(named(container, KITS, "Aino").id)
    settle(screen, ui)
    for word in ("Save changes", "Skip a start"):
        button = ui.find(CommandButton, text=word)
        assert checks.is_seen(button)
        bottom, y = low.to_window(*low.pos)[1], button.to_window(*button.pos)[1]
        assert bottom <= y
        assert y + button.height <= bottom + low.height
    assert not low.ids.page.do_scroll_y
    assert checks.problems(low) == []


@pytest.mark.parametrize("height", [552, 576, 608, 640])
def test_lanes_of_the_plan_are_seen_whole_and_so_are_the_rows_below(low, screen, ui, height):
    """1280×800 with and without the banner of an alarm, and between."""
    low.size = 1232, height
    settle(screen, ui)
    plan = ui.find(Timeline)
    lanes = (plan.parent.height - dp(AXIS)) / plan.lane_height
    assert lanes == pytest.approx(round(lanes), abs=0.05)
    assert lanes >= 2
    rows = ui.find(LongList, root=ui.find(SchedulesCard))
    assert len(rows.whole_rows) >= 3
    assert min(view.y for view in rows.views) >= -1
    assert not low.ids.page.do_scroll_y


def test_an_alarm_that_makes_the_window_low_does_not_close_the_form(low, screen, container, ui):
    low.size = 1232, 640
    settle(screen, ui)
    low.size = 976, 440  # nothing is in the form: the plan is what there is to see
    settle(screen, ui)
    assert ui.find_all(UpcomingCard)
    low.size = 1232, 640
    settle(screen, ui)
    low.vm.form.set(mission_id=named(container, KITS, "Aino").mission_id)
    settle(screen, ui)
    low.size = 976, 440
    settle(screen, ui)
    assert ui.find(FormCard).view.mission == KITS


def test_a_schedule_that_is_opened_while_another_is_being_saved_stays_in_the_form(low, screen, container, ui):
    settle(screen, ui)
    first, second = schedules(container)[:2]
    low.vm.edit(first.id)
    low.vm.form.set(priority=first.priority + 1)
    settle(screen, ui)
    low.vm.form.save()
    low.vm.edit(second.id)
    settle(screen, ui)
    assert container.repositories.schedules.get(container.db.read(), first.id).priority == first.priority + 1
    assert low.vm.form.editing == second.id
    assert ui.find_all(FormCard)
