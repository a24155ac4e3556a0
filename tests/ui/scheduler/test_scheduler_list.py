"""The list of schedules: what it says before it is read, and where its rows stay when they are tapped."""
from __future__ import annotations

from app.screens.common.shell import pick
from app.screens.scheduler.facts import SchedulerFacts


def test_that_there_are_no_schedules_is_said_once_it_is_known(screen, container, ui):
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
