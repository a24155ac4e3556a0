"""The length of the history, in Settings: what a lower limit would delete is asked first, also when a file brings it."""

from __future__ import annotations

import pytest

from app.screens.settings.data import ImportSheet
from app.screens.settings.page import SwitchRow
from app.screens.settings.scheduler import SchedulerPage
from app.widgets.buttons import Segment, Toggle
from app.widgets.fields import Field
from app.widgets.sheet import AskSheet
from tests.support.history import add_runs
from tests.ui.integrator import enter, file_sheet, go, is_saved, page, press, says, settings

pytestmark = pytest.mark.long


def keep_the_last(ui, runs: int) -> Field:
    field = ui.find(Field, label="Otherwise keep the last")
    enter(ui, field, str(runs))
    field.focus = False
    return field


def test_a_lower_limit_deletes_nothing_before_it_is_confirmed(site, app, ui):
    add_runs(site.container, 3)
    go(ui, "scheduler")
    field = keep_the_last(ui, 2)
    ui.wait(lambda: says(ui, "Delete 1 run of the history?"))
    assert says(ui, "The oldest ones beyond the last 2 are deleted for ever.")
    press(ui, "Keep", ui.find(AskSheet))
    ui.wait(lambda: field.value == 100_000)  # what is kept is shown again
    assert settings(site).history_limit == 100_000
    keep_the_last(ui, 3)  # deletes nothing
    ui.wait(lambda: settings(site).history_limit == 3)
    ui.wait(lambda: is_saved(site, app))
    keep_the_last(ui, 1)
    ui.wait(lambda: says(ui, "Delete 2 runs of the history?"))
    press(ui, "Delete", ui.find(AskSheet))
    ui.wait(lambda: settings(site).history_limit == 1)


def test_leaving_before_the_question_says_that_nothing_is_deleted(site, app, ui):
    add_runs(site.container, 3)
    go(ui, "scheduler")
    ui.find(SchedulerPage).keep(2)
    app.shell.go("home")
    said = "Not asked, as the page was left: Delete 1 run of the history?"
    ui.wait(lambda: said in app.shell.snackbars.texts)
    assert not ui.find_all(AskSheet)
    assert settings(site).history_limit == 100_000


def test_how_many_runs_are_kept_is_one_of_a_few_choices_or_typed(site, app, ui):
    """The hundred of the thesis is one tap, and the choice that holds is marked."""
    go(ui, "scheduler")
    ui.wait(lambda: ui.find(Segment, key=100_000).selected)
    ui.tap(ui.find(Segment, key=100))
    ui.wait(lambda: settings(site).history_limit == 100)
    ui.wait(lambda: is_saved(site, app))
    field = keep_the_last(ui, 250)
    ui.wait(lambda: settings(site).history_limit == 250)
    ui.wait(lambda: field.value == 250)
    ui.wait(
        lambda: (
            not [
                segment
                for segment in ui.find_all(Segment)
                if segment.selected and segment.key in (100, 1_000, 10_000, 100_000)
            ]
        )
    )


def test_an_end_of_keeping_all_asks_too(site, app, ui):
    site.container.catalogue.change_settings(history_limit=1)
    go(ui, "scheduler")
    ui.wait(lambda: ui.find(Field, label="Otherwise keep the last").value == 1)
    site.container.catalogue.change_settings(history_limit=None)
    add_runs(site.container, 2)
    switch = ui.find(SwitchRow, text="Keep the whole history")
    ui.wait(lambda: switch.active)
    ui.tap(ui.find(Toggle, root=switch))
    ui.wait(lambda: says(ui, "Delete 1 run of the history?"))
    press(ui, "Keep", ui.find(AskSheet))
    ui.wait(lambda: app.shell.background.idle)
    assert settings(site).history_limit is None
    assert switch.active


def previewed(site, ui) -> ImportSheet:
    """What a configuration changes that keeps one run."""
    file = site.documents / "plant.json"
    file.write_text('{"format": "amr-scheduler/1", "settings": {"history_limit": 1}}', encoding="utf-8")
    go(ui, "data")
    press(ui, "Show changes", file_sheet(ui, "Configuration", "Import"))
    ui.wait(lambda: ui.find_all(ImportSheet))
    return ui.find(ImportSheet)


def test_a_configuration_that_deletes_runs_says_so_before_it_is_imported(site, app, ui):
    add_runs(site.container, 3)
    changes = previewed(site, ui)
    ui.wait(lambda: says(ui, "Deletes the oldest 2 runs for ever"))
    assert settings(site).history_limit == 100_000
    press(ui, "Import", changes)
    ui.wait(lambda: page(app).vm.outcome.text == "1 change imported")
    assert settings(site).history_limit == 1


def test_an_import_refused_after_its_sheet_was_left_says_what_the_sheet_would(site, app, ui):
    changes = previewed(site, ui)
    add_runs(site.container, 3)
    press(ui, "Import", changes)
    app.shell.sheets.give_up()
    ui.wait(lambda: app.shell.snackbars.texts == ["Not imported: Deletes the oldest 2 runs for ever"])


def test_runs_that_end_after_the_preview_are_shown_before_they_are_deleted(site, app, ui):
    changes = previewed(site, ui)
    add_runs(site.container, 3)
    press(ui, "Import", changes)
    ui.wait(lambda: changes.problem == "Deletes the oldest 2 runs for ever" and not changes.busy)
    assert (settings(site).history_limit, site.container.files.backups()) == (100_000, [])
    press(ui, "Import", changes)
    ui.wait(lambda: page(app).vm.outcome.text == "1 change imported")
    assert (settings(site).history_limit, len(site.container.files.backups())) == (1, 1)
