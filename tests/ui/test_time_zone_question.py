"""Where it isn't certain which time zone the tablet has, the window asks at the first start."""

from __future__ import annotations

import pytest

from app.container import Container
from app.database.connection import Database
from app.screens.common.pin_sheet import PinSheet
from app.services.live.tablet_zone import TabletZone
from app.widgets.choices import ChoiceSheet
from app.widgets.number_pad import PadKey
from app.widgets.snackbar import Snackbar
from tests.support.clock import VirtualClock
from tests.ui.integrator import undo
from tests.ui.whole_app import shown

QUESTION = "Which time zone is this tablet in?"


@pytest.fixture
def tablet(tmp_path):
    """At 06:00 UTC."""
    clock = VirtualClock()
    container = Container(
        Database.open(tmp_path / "a.db", clock=clock, durable=False),
        clock,
        find_zone=lambda: TabletZone("Europe/Helsinki", "/etc/localtime", False),
    )
    container.first_start()
    yield container
    container.close()


def asked(ui):
    return ui.find_all(ChoiceSheet, title=QUESTION)


def choose(ui, zone):
    asked(ui)[0].query = zone.partition("/")[2]
    ui.advance(0.2)
    ui.tap_text(zone)


def test_the_guess_is_on_top_with_the_time_there_and_the_choice_ends_the_alarm(tablet, ui):
    with shown(tablet, ui):
        ui.wait(lambda: asked(ui))
        [dialog] = asked(ui)
        first = dialog.shown[0]
        assert (first.text, first.note) == ("Europe/Helsinki", "08:00 · UTC+02:00")
        choose(ui, "Europe/Tallinn")
        ui.wait(lambda: tablet.settings().timezone == "Europe/Tallinn")
        assert tablet.alarms.open() == []
        ui.advance(2)
        assert asked(ui) == []


@pytest.mark.long
def test_unanswered_it_is_asked_at_the_next_start_and_by_the_alarm(tablet, ui):
    with shown(tablet, ui):
        ui.wait(lambda: asked(ui))
        asked(ui)[0].dispatch("on_close")
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


@pytest.mark.long
def test_a_choice_says_what_it_was_and_undone_it_is_asked_for_again(tablet, ui):
    with shown(tablet, ui):
        ui.wait(lambda: asked(ui))
        choose(ui, "Pacific/Apia")
        ui.wait(lambda: ui.find_all(Snackbar, text="The time zone is Pacific/Apia"))
        undo(ui)
        ui.wait(lambda: asked(ui))
        assert tablet.settings().timezone == "Europe/Helsinki"
        assert [alarm.code for alarm in tablet.alarms.open()] == ["zone_guessed"]
        assert asked(ui)[0].shown[0].text == "Europe/Helsinki"
        choose(ui, "Europe/Tallinn")
        ui.wait(lambda: tablet.settings().timezone == "Europe/Tallinn" and tablet.alarms.open() == [])


def test_where_a_pin_is_set_it_is_asked_for_before_a_zone_is_taken(tablet, ui):
    tablet.access.set_pin("4711")
    with shown(tablet, ui):
        ui.wait(lambda: asked(ui))
        choose(ui, "Pacific/Apia")
        ui.wait(lambda: ui.find_all(PinSheet))
        assert tablet.settings().timezone == "Europe/Helsinki"
        for key in ({"text": "4"}, {"text": "7"}, {"text": "1"}, {"text": "1"}, {"icon": "check"}):
            ui.tap(ui.find(PadKey, ui.find(PinSheet), **key))
        ui.wait(lambda: tablet.settings().timezone == "Pacific/Apia")
