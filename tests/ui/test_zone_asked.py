"""Where it isn't certain which time zone the tablet has, the window asks at the first start."""
from __future__ import annotations

import pytest

from app.container import Container
from app.database.connection import Database
from app.services.live.tablet_zone import TabletZone
from app.widgets.dialogs import ChoiceDialog
from tests.support.clock import VirtualClock
from tests.ui.whole_app import shown

QUESTION = "Which time zone is this tablet in?"


@pytest.fixture
def tablet(tmp_path):
    """At 06:00 UTC."""
    clock = VirtualClock()
    container = Container(Database.open(tmp_path / "a.db", clock=clock, durable=False), clock,
                          find_zone=lambda: TabletZone("Europe/Helsinki", "/etc/localtime", False))
    container.first_start()
    yield container
    container.close()


def asked(ui):
    return ui.find_all(ChoiceDialog, title=QUESTION)


def test_the_guess_is_on_top_with_the_time_there_and_the_choice_ends_the_alarm(tablet, ui):
    with shown(tablet, ui):
        ui.wait(lambda: asked(ui))
        [dialog] = asked(ui)
        first = dialog.shown[0]
        assert (first.text, first.note) == ("Europe/Helsinki", "08:00 · UTC+02:00")
        dialog.query = "Tallinn"
        ui.advance(.2)
        ui.tap_text("Europe/Tallinn")
        ui.wait(lambda: tablet.settings().timezone == "Europe/Tallinn")
        assert tablet.alarms.open() == []
        ui.advance(2)
        assert asked(ui) == []


def test_unanswered_it_is_asked_at_the_next_start_and_by_the_alarm(tablet, ui):
    with shown(tablet, ui):
        ui.wait(lambda: asked(ui))
        asked(ui)[0].dismiss()
        ui.advance(3)
        assert asked(ui) == []
    with shown(tablet, ui):
        ui.wait(lambda: asked(ui))


def test_a_zone_that_is_certain_is_not_asked_about(tablet, ui):
    tablet.catalogue.change_settings(timezone="Europe/Helsinki")
    with shown(tablet, ui) as app:
        ui.wait(lambda: app.shell.background.idle)
        ui.advance(1)
        assert asked(ui) == []
