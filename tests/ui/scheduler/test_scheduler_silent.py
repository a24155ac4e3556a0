"""A robot that stops answering while the Scheduler is on screen."""
from __future__ import annotations

from app.domain.models import Connection
from app.widgets.plan_rows import ScheduleLine
from app.widgets.timeline import Timeline
from tests.ui.planner import KITS, named, settle


def notes(ui) -> dict[str, str]:
    return {lane.name: lane.note for lane in ui.find(Timeline).lanes}


def test_lane_and_list_say_that_it_does_not_answer_and_that_it_does_again(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    model = notes(ui)["Aino"]
    for connection, note in ((Connection.UNREACHABLE, "No answer"), (Connection.CONNECTED, model)):
        container.snapshots.update(schedule.robot_id, connection=connection)
        ui.skip(1)
        ui.wait(lambda note=note: notes(ui)["Aino"] == note)
        settle(screen, ui)
        assert ("no answer" in ui.find(ScheduleLine, key=schedule.id).next) == (connection is Connection.UNREACHABLE)
    assert notes(ui)["Sisu"] != "No answer"
