"""A robot that stops answering while the Scheduler is on screen."""

from __future__ import annotations

import pytest

from app.domain.models import Connection
from app.widgets.lanes import Lanes
from tests.ui.planner import KITS, named

pytestmark = pytest.mark.long


def notes(ui) -> dict[str, str]:
    return {lane.name: lane.note for lane in ui.find(Lanes).lanes}


@pytest.mark.parametrize(
    ("silence", "words"), [(Connection.UNREACHABLE, "No answer"), (Connection.UNAUTHORIZED, "Wrong password")]
)
def test_lane_and_list_say_that_it_does_not_answer_and_that_it_does_again(screen, container, ui, silence, words):
    schedule = named(container, KITS, "Aino")
    model = notes(ui)["Aino"]
    for connection, note in ((silence, words), (Connection.CONNECTED, model)):
        container.snapshots.update(schedule.robot_id, connection=connection)
        ui.skip(1)  # far from when all is read again anyhow
        ui.wait(lambda: screen.shell.background.idle)
        ui.advance()
        assert notes(ui)["Aino"] == note
        assert (words in next(row.support for row in screen.plan.listed.rows if row.key == schedule.id)) == (
            connection is silence
        )
    assert notes(ui)["Sisu"] != words
