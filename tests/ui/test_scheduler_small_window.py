"""The Scheduler in small windows, with large texts and in both languages: each of its tabs and the form is whole."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date, time

import pytest
from kivy.factory import Factory
from kivy.metrics import sp

from app.screens.scheduler.cards import FormFold, FormNote, FormSheet, FormWarning
from app.screens.scheduler.draft import Kind
from app.widgets.buttons import MenuChip
from app.widgets.chart import glyphs
from app.widgets.text import Txt
from tests.screenshots.planning import Stand, fifty
from tests.ui import checks, looks
from tests.ui.planner import KITS
from tests.ui.window_sizes import window

WINDOWS = [
    *(((1024, 600), scale, language) for scale in (1.0, 1.3) for language in ("en", "fi")),
    *(((800, 1280), 1.3, language) for language in ("en", "fi")),
    ((1280, 800), 1.3, "fi"),
]
EVERY_KIND = (
    {"kind": Kind.ONCE},
    {"kind": Kind.WEEKLY},
    {"kind": Kind.EVERY, "every": 4},
    {"kind": Kind.MONTHLY, "by_weekday": True, "nth": 1, "month_weekday": "MO"},
    {"kind": Kind.MONTHLY, "by_weekday": False, "month_day": 31},
)


@pytest.fixture(params=WINDOWS, ids=lambda way: f"{way[0][0]}×{way[0][1]}-{way[1]}-{way[2]}")
def small(ui, request) -> Iterator[Stand]:
    with window(ui, *request.param) as rig:
        stand = Stand(rig, "scheduler")
        stand.settle()
        yield stand


@pytest.mark.long
def test_each_tab_is_whole(ui, small):
    for tab in ("plan", "schedules", "suggestions"):
        small.screen.choose_tab(tab)
        small.settle()
        assert looks.scrolls(small.screen) == []
        assert looks.targets(small.screen) == []
        assert len(looks.filled(small.screen)) <= 1


@pytest.mark.long
def test_the_order_of_the_schedules_is_written_out_where_there_is_room(ui):
    with window(ui, (1280, 800), 1.0, "fi") as rig:
        stand = Stand(rig, "scheduler")
        stand.settle()
        stand.screen.choose_tab("schedules")
        stand.settle()
        chip = ui.find(MenuChip, text="Seuraavan aloituksen mukaan")
        assert glyphs(chip.text, sp(16), "RobotoMedium").width <= ui.find(Txt, chip).width


@pytest.mark.long
@pytest.mark.parametrize(("width", "found"), [(800, ["Kaikki robotit"]), (600, [])])
def test_the_robots_of_a_tall_plan_are_chosen_above_it_where_there_is_room(ui, width, found):
    with window(ui, (width, 1280), 1.3, "fi") as rig:
        stand = Stand(rig, "scheduler", prepare=fifty)
        stand.settle()
        assert [chip.text for chip in ui.find_all(MenuChip) if chip.text != "8 h"] == found
        assert looks.targets(stand.screen) == []


@pytest.mark.long
def test_the_form_scrolls_alone_and_save_is_always_seen(ui, small):
    small.vm.begin()
    form = small.vm.form
    form.set(mission_id=small.mission(KITS), day=date(2026, 11, 23), at=time(6, 30))
    for values in EVERY_KIND:
        form.set(**values)
        small.settle()
        sheet = ui.find(FormSheet)
        assert looks.scrolls(sheet) == []
        assert len(looks.filled(sheet)) == 1
        save = next(button for button in looks.labels(sheet) if button.text in ("Save", "Tallenna"))
        assert checks.is_seen(save)


@pytest.mark.parametrize(
    ("size", "gloves", "scale"), [((1280, 800), False, 1.0), ((1024, 600), True, 1.3), ((800, 1280), False, 1.3)]
)
def test_what_a_schedule_overlaps_with_is_seen_once_and_next_to_save_a_tap_leads_to_it(ui, size, gloves, scale):
    with window(ui, size, scale, gloves=gloves) as rig:
        stand = Stand(rig, "scheduler")
        stand.settle()
        stand.vm.begin()
        day, begins, ends = date(2026, 11, 23), time(8), time(16)
        stand.vm.form.set(
            mission_id=stand.mission(KITS), kind=Kind.EVERY, every=30, day=day, at=begins, until_time=ends
        )
        stand.settle()
        sheet = ui.find(FormSheet)
        warning = ui.find(FormWarning, sheet)

        def said() -> tuple[bool, list[str]]:
            """In the note that is seen, and next to Save."""
            ui.advance(0.3)
            words = [label.text for label in looks.labels(warning) if "overlaps with" in label.text]
            return checks.is_seen(ui.find_all(FormNote, sheet)[0]), words

        sheet.ids.page.scroll_y = 1
        seen, words = said()
        assert (seen, bool(words)) == (not words, not seen)
        if size == (1024, 600):
            assert words[0].startswith(stand.vm.form.view.notes[0].text)
            assert checks.is_seen(warning)
            ui.tap(warning)
            assert said() == (True, [])


@pytest.mark.parametrize(("size", "rows"), [((800, 1280), [7]), ((1280, 800), [3, 4])])
def test_with_gloves_the_days_are_in_one_row_where_seven_fit(ui, size, rows):
    with window(ui, size, gloves=True) as rig:
        stand = Stand(rig, "scheduler")
        stand.settle()
        stand.vm.begin()
        stand.vm.form.set(mission_id=stand.mission(KITS), kind=Kind.WEEKLY, day=date(2026, 11, 23), at=time(6, 30))
        stand.settle()
        days = ui.find_all(Factory.DaySegments, ui.find(FormSheet))
        assert sorted(len(each.children) for each in days) == rows
        assert looks.targets(ui.find(FormSheet)) == []


@pytest.mark.long
def test_advanced_opens_at_the_top_of_the_sheet(ui, small):
    small.vm.begin()
    small.vm.form.set(mission_id=small.mission(KITS), day=date(2026, 11, 23), at=time(6, 30))
    small.settle()
    sheet = ui.find(FormSheet)
    fold, page = ui.find(FormFold, sheet), sheet.ids.page
    page.scroll_y = 0  # it is the last line
    ui.advance(0.3)
    ui.tap(fold)
    ui.advance(1)
    below = page.to_window(0, page.top)[1] - fold.to_window(0, fold.top)[1]
    assert below == pytest.approx(0, abs=2) or (
        below > 0 and (not page.do_scroll_y or page.scroll_y == 0)
    )  # all of it is in sight
