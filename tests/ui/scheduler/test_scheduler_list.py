"""The list of schedules: what it says before it is read, and where its rows stay when they are tapped."""

from __future__ import annotations

from app.screens.common.shell import pick
from app.screens.scheduler.cards import SchedulesCard
from app.screens.scheduler.facts import SchedulerFacts
from app.widgets.long_list import LongList
from app.widgets.plan_rows import ScheduleLine
from tests.ui.planner import settle


def test_an_empty_list_says_so_once_it_was_read(screen, container, ui):
    model = type(screen.plan)(pick(type(screen.shell.navigator.screen("scheduler")).Services, container), screen.shell)
    model.open()
    try:
        model._tick()
        assert (model.listed.rows, model.listed.empty) == ([], "")
        ui.wait(lambda: model.listed.rows)
        assert model.listed.empty == ""
        model.listed.show(SchedulerFacts(), None)
        assert model.listed.empty.startswith("No schedule yet.")
    finally:
        model.close()


def test_the_row_of_what_is_edited_comes_in_sight(screen, container, ui):
    rows = ui.find(LongList, ui.find(SchedulesCard))
    last = screen.plan.listed.rows[-1].key
    assert last not in [row.key for row in rows.whole_rows]
    screen.plan.edit(last)
    settle(screen, ui)
    ui.advance(0.3)
    assert last in [row.key for row in rows.whole_rows]
    before = [row.key for row in rows.whole_rows]
    screen.plan.edit(before[-1])
    settle(screen, ui)
    ui.advance(0.3)
    assert [row.key for row in rows.whole_rows] == before  # nothing moves where it is in sight already


def test_a_row_that_is_tapped_stays_where_it_is_also_where_a_part_of_it_is_seen(screen, container, ui):
    rows = ui.find(LongList, ui.find(SchedulesCard))
    cut = next(row for row in rows.views if row not in rows.whole_rows)
    x, bottom = rows.to_window(*rows.pos)
    top = cut.to_window(0, cut.top)[1]
    place, first = (x + 120, (bottom + top) / 2), rows.whole_rows[0].key
    ui.tap_at(*place)
    settle(screen, ui)
    ui.advance(0.3)
    assert screen.plan.form.editing == cut.key
    assert rows.whole_rows[0].key == first
    assert ui.find(ScheduleLine, key=cut.key).to_window(0, cut.top)[1] == top
