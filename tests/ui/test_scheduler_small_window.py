"""The Scheduler in small windows, with large texts and in both languages: plan, form and schedules one at a time, each of them whole."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import date, time

import pytest
from kivy.core.window import Window
from kivy.metrics import dp
from kivy.uix.scrollview import ScrollView

from app.i18n import _
from app.screens.scheduler.cards import FormCard, HoursPart, SchedulesCard, StartChip, TimeControls, UpcomingCard
from app.screens.scheduler.draft import Kind
from app.widgets.buttons import CommandButton, Segment, Segments
from app.widgets.display import LegendItems
from app.widgets.fields import PickField
from app.widgets.frame import Frame
from app.widgets.long_list import LongList
from app.widgets.plan_rows import DayLine, ScheduleLine
from app.widgets.text import BodyStrong
from tests.screenshots.planning import Stand
from tests.ui import checks
from tests.ui.planner import KITS
from tests.ui.window_sizes import reach, window

PARTS = {"hours": UpcomingCard, "days": UpcomingCard, "form": FormCard, "schedules": SchedulesCard}
EVERY_KIND = (
    {"kind": Kind.ONCE},
    {"kind": Kind.DAILY},
    {"kind": Kind.WEEKLY},
    {"kind": Kind.EVERY, "every": 4},
    {"kind": Kind.MONTHLY, "by_weekday": True, "nth": 1, "month_weekday": "MO"},
)
FAILED = "Aino: Failed to reach its goal"
WINDOWS = [
    *(((1024, 600), scale, language, "") for scale in (1.0, 1.3) for language in ("en", "fi")),
    ((800, 800), 1.3, "en", ""),
    *(((600, 800), 1.3, language, alarm) for language in ("en", "fi") for alarm in ("", FAILED)),
]
LOW = [
    *(((600, 480), scale, language, alarm) for scale, language in ((1.0, "en"), (1.3, "fi")) for alarm in ("", FAILED)),
    ((800, 480), 1.0, "fi", ""),
    ((800, 480), 1.3, "fi", FAILED),
    ((720, 1600), 1.3, "fi", ""),
]
LEAST = [
    ((600, 480), 1.0, "en", ""),
    ((600, 480), 1.0, "en", FAILED),
    ((600, 480), 1.3, "fi", FAILED, "gloves"),
    ((800, 480), 1.0, "en", FAILED, "gloves"),
    ((800, 480), 1.3, "fi", FAILED, "gloves"),
]
USUAL = [((1280, 800), scale, language, "") for scale in (1.0, 1.3) for language in ("en", "fi")]


def name_of_window(way: tuple) -> str:
    (width, height), scale, language, alarm, *gloves = way
    return "-".join((f"{width}×{height}", str(scale), language, *(["alarm"] if alarm else []), *gloves))


@pytest.fixture(params=WINDOWS, ids=name_of_window)
def small(ui, request) -> Iterator[Stand]:
    """The Scheduler in its frame, in a small window."""
    *way, alarm = request.param[:4]
    with window(ui, *way, gloves="gloves" in request.param) as rig:
        stand = Stand(rig, "scheduler")
        ui.find(Frame).alarm = alarm
        stand.vm.form.set(
            mission_id=stand.mission(KITS), day=date(2026, 11, 23), at=time(6, 30), minimum_battery_percent=40.0
        )
        stand.settle()
        yield stand


def test_each_part_is_a_page_that_is_whole(ui, small):
    for part, card in PARTS.items():
        small.vm.choose_part(part)
        small.settle()
        assert [kind for kind in dict.fromkeys(PARTS.values()) if ui.find_all(kind)] == [card]
        assert "\n".join(checks.problems(small.screen)) == ""
        scrolled = [view for view in ui.find_all(ScrollView, small.screen) if view.do_scroll_y]
        assert not [view for view in scrolled if [outer for outer in checks.parents(view) if outer in scrolled]]
        (chosen,) = (segment for segment in ui.find_all(Segments, small.screen)[0].children if segment.selected)
        assert chosen.key == part


def test_mission_robot_day_and_time_and_the_way_to_save_are_seen_at_once(ui, small):
    small.vm.choose_part("form")
    for values in EVERY_KIND:
        small.vm.form.set(**values)
        small.settle()
        view = small.vm.form.view
        first = [
            field
            for field in ui.find_all(PickField)
            if field.label in (_("Mission"), _("Robot"), view.day_label, view.time_label)
        ]
        assert len(first) == 4
        for widget in (
            *first,
            ui.find(CommandButton, text=view.save),
            *(one for one in ui.find_all(Segment) if one.key == values["kind"]),
        ):
            assert checks.is_seen(widget), checks.name_of(widget)
        assert "\n".join(checks.problems(small.screen)) == ""


def test_the_list_uses_the_width_of_a_window_that_was_turned(ui, small):
    small.vm.choose_part("days")
    small.settle()
    for size in ((1024, 600), (800, 800), (600, 800), (1024, 600)):
        Window.size = size
        small.settle()
        ui.advance(0.5)
        starts = [line for line in ui.find_all(DayLine) if line.mission]
        assert starts
        assert all(line.columns or line.ids.line_words.width > 0.75 * line.width for line in starts), size


def ends_of_starts(ui):
    return [line.ids[part] for line in ui.find_all(DayLine) if line.columns for part in ("line_until", "line_needs")]


@pytest.mark.parametrize("small", [*WINDOWS, *USUAL], ids=name_of_window, indirect=True)
def test_a_battery_without_a_minimum_and_the_ends_of_starts_are_on_one_line(ui, small):
    small.vm.choose_part("form")
    small.vm.form.set(minimum_battery_percent=0.0)
    small.settle()
    assert ui.find(BodyStrong, ui.find(PickField, label=_("Battery ≥"))).lines == 1
    small.vm.choose_part("days")
    small.settle()
    ui.wait(lambda: all(label.lines <= 1 for label in ends_of_starts(ui)))  # in the next frames
    assert ends_of_starts(ui) or Window.width <= 800


def test_a_list_of_schedules_without_room_shows_part_of_the_next(ui, small):
    small.vm.choose_part("schedules")
    small.settle()
    rows = ui.find(LongList)
    assert rows.more_below == (rows.content_height > rows.height + 2)
    lowest = min(checks.visible_area(line, checks.parents(line))[1] for line in rows.views)
    assert lowest - checks.area(rows)[1] <= rows.spacing or not rows.more_below


def test_save_and_skip_are_visible_while_a_schedule_is_edited(ui, small):
    small.vm.edit(small.schedule(KITS).id)
    small.settle()
    for word in (small.vm.form.view.save, _("Skip a start")):
        button = ui.find(CommandButton, text=word)
        assert checks.is_seen(button)
    assert "\n".join(checks.problems(small.screen)) == ""


@pytest.mark.parametrize("edited", [False, True], ids=["new", "edited"])
@pytest.mark.parametrize("small", LOW, ids=name_of_window, indirect=True)
def test_each_field_the_next_starts_and_the_way_to_save_can_be_reached(ui, small, edited):
    """And nothing overlaps, at any scroll position."""
    if edited:
        small.vm.edit(small.schedule(KITS).id)
    small.vm.choose_part("form")
    small.settle()
    form = ui.find(FormCard)
    wanted = (
        *ui.find_all(PickField, form),
        *ui.find_all(Segments, form),
        *ui.find_all(StartChip, form),
        *ui.find_all(CommandButton, form),
    )
    assert {PickField, Segments, StartChip, CommandButton} <= {type(widget) for widget in wanted}
    assert form.ids.save in wanted
    for widget in wanted:
        reach(ui, widget)
        assert "\n".join(checks.problems(ui.find(Frame))) == ""


@pytest.mark.parametrize("searched", [False, True], ids=["", "searched"])
@pytest.mark.parametrize("small", LEAST, ids=name_of_window, indirect=True)
def test_whole_lanes_and_rows_of_each_part_can_be_reached(ui, small, searched):
    """The page scrolls where they would have no room, and nothing lies over anything else."""
    small.vm.listed.searching = searched
    for part, kind in (("hours", TimeControls), ("days", DayLine), ("schedules", ScheduleLine)):
        small.vm.choose_part(part)
        small.settle()
        first = ui.find_all(kind)[0]
        assert "\n".join(checks.problems(ui.find(Frame))) == ""
        assert checks.is_seen(ui.find(Segments, small.screen))
        reach(ui, first)
        if part == "hours":
            reach(ui, ui.find(LegendItems))
            lanes = ui.find(HoursPart)
            assert lanes.height >= dp(28) + 2 * dp(44)
            assert checks.visible_area(lanes, checks.parents(lanes))[3] - checks.area(lanes)[1] >= dp(44)
        assert "\n".join(checks.problems(ui.find(Frame))) == ""
        small.screen.ids.page.scroll_y = 0
        small.vm.choose_part("form")
        assert small.screen.ids.page.scroll_y == 1


@pytest.mark.parametrize("small", LOW[:1], ids=name_of_window, indirect=True)
def test_a_field_with_a_problem_comes_in_sight_where_the_page_scrolls(ui, small):
    small.vm.choose_part("form")
    small.settle()
    form = ui.find(FormCard)
    reach(ui, form.ids.save)
    field = ui.find(PickField, label=_("Mission"))
    assert not checks.is_seen(field)
    form.view = replace(form.view, wrong_field="mission", why="Choose a mission")
    ui.advance(0.2)
    assert checks.is_seen(ui.find(text="Choose a mission", root=form.ids.fields))


@pytest.mark.parametrize("small", [((800, 1280), 1.3, "fi", FAILED, "gloves")], ids=name_of_window, indirect=True)
def test_form_and_schedules_share_a_tall_window(ui, small):
    assert not small.screen.paged
    assert "\n".join(checks.problems(ui.find(Frame))) == ""


@pytest.mark.parametrize("held", [False, True], ids=["", "held"])
@pytest.mark.parametrize(
    ("scale", "language", "gloves"), [(1.0, "en", False), (1.0, "en", True), (1.3, "en", False), (1.3, "fi", False)]
)
def test_a_tall_narrow_window_has_room_for_every_word(ui, scale, language, gloves, held):
    """720×1600, held or not: what the plan is called goes before what is pressed does."""
    with window(ui, (720, 1600), scale, language, gloves=gloves) as rig:
        stand = Stand(rig, "scheduler")
        stand.settle()
        stand.vm.held = held
        ui.advance(0.2)
        assert "\n".join(checks.problems(stand.screen)) == ""
        assert (_("Upcoming") in ui.texts()) == (scale == 1.0 or not held)
