"""The PIN before Settings: kept as a hash, asked with patience, in no export and no log."""

from __future__ import annotations

import logging
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest

from app.database.connection import Database
from app.database.settings import WRONG_PINS, SettingsRepository
from app.domain.models import InvalidInput
from app.services.catalogue import configuration
from app.services.live import access
from app.services.live.access import ALARM_AFTER, TRIES, WAIT_S, Access, Verdict, is_easy_to_guess
from app.services.live.alarms import Alarms, alarm_sentence
from app.services.live.changes import Changes
from tests.support.clock import VirtualClock


class Door:
    def __init__(self, path):
        self.clock = VirtualClock()
        self.db = Database.open(path / "a.db", clock=self.clock, durable=False)
        self.access = self.again()

    def again(self) -> Access:
        """As after a restart."""
        changes = Changes()
        self.alarms = Alarms(self.db, self.clock, changes)
        return Access(self.db, self.clock, changes, self.alarms)


@pytest.fixture
def door(tmp_path, monkeypatch):
    monkeypatch.setitem(access._COST, "n", 2)  # the cost of a try, which is not what is tested
    door = Door(tmp_path)
    yield door
    door.db.close()


@pytest.fixture
def locked(door):
    door.access.set_pin("4711")
    return door


def test_without_a_pin_the_door_is_open(door):
    assert not door.access.is_set()
    assert door.access.check("") == Verdict(True)


@pytest.mark.parametrize("pin", ["", "123", "123456789", "12a4", "１２３４", "12 34", "-123"])
def test_a_pin_has_four_to_eight_digits(door, pin):
    with pytest.raises(InvalidInput, match="4 to 8 digits"):
        door.access.set_pin(pin)
    assert not door.access.is_set()


def test_it_is_set_changed_and_removed_and_survives_a_restart(locked):
    assert locked.again().check("4711").is_right
    assert not locked.again().check("04711").is_right
    locked.access.set_pin("00000000")
    assert not locked.again().check("4711").is_right
    assert locked.again().check("00000000").is_right
    assert locked.access.remove() is True
    assert locked.access.remove() is False
    assert not locked.again().is_set()


def test_after_five_wrong_ones_nothing_is_taken_for_half_a_minute(locked):
    assert [locked.access.check("0000").tries_left for _n in range(TRIES)] == [4, 3, 2, 1, 0]
    assert locked.access.check("4711") == Verdict(False, 0, WAIT_S)
    locked.clock.step(3600)  # the tablet's clock was set
    assert locked.access.check("4711").wait_s == WAIT_S
    locked.clock.advance(WAIT_S - 1)
    assert locked.access.check("4711").wait_s == 1
    locked.clock.advance(1)
    assert locked.access.check("4711").is_right
    assert locked.access.check("0000") == Verdict(False, 4)


def guess(door, times: int) -> list[float]:
    """The seconds to wait after each wrong PIN, which are waited."""
    waits = []
    for _n in range(times):
        waits.append(door.access.check("0000").wait_s)
        door.clock.advance(waits[-1])
    return waits


def test_further_guesses_wait_twice_as_long_each_time_and_an_hour_at_most(locked):
    assert guess(locked, 14) == [0, 0, 0, 0, 30, 60, 120, 240, 480, 960, 1920, 3600, 3600, 3600]
    assert locked.access.check("4711").is_right
    assert guess(locked, 5) == [0, 0, 0, 0, 30]


def test_a_restart_shortens_no_waiting_time(locked):
    guess(locked, 7)
    locked.access.check("0000")
    locked.clock.advance(200)
    locked.access = locked.again()
    assert locked.access.check("4711") == Verdict(False, 0, 240)
    locked.clock.advance(240)
    assert locked.access.check("0000").wait_s == 480


def test_ten_wrong_ones_are_an_alarm_until_the_right_one_comes(locked):
    guess(locked, ALARM_AFTER - 1)
    assert locked.alarms.open() == []
    guess(locked, 2)
    [alarm] = locked.alarms.open()
    assert (alarm.code, alarm.count, alarm.cleared_at) == ("pin_guessed", 1, None)
    assert alarm_sentence(alarm) == "Somebody is guessing the PIN of Settings: 10 wrong ones in a row, or more"
    assert locked.access.check("4711").is_right
    [alarm] = locked.alarms.open()
    assert alarm.cleared_at is not None


def test_many_at_one_instant_are_tried_one_after_the_other(locked):
    """Else all of them are judged before the first is counted."""
    begin = Barrier(20)

    def attempt(number: int) -> Verdict:
        begin.wait()
        return locked.access.check(f"{number:04}")

    with ThreadPoolExecutor(20) as pool:
        verdicts = list(pool.map(attempt, range(20)))
    assert sorted(verdict.tries_left for verdict in verdicts) == [0] * 16 + [1, 2, 3, 4]
    locked.clock.advance(WAIT_S)
    assert locked.access.check("4711").is_right


def test_a_count_that_outlived_a_restored_backup_is_an_alarm_again(locked):
    locked.db.write(lambda c: SettingsRepository().put(c, WRONG_PINS, ALARM_AFTER))
    locked.access = locked.again()
    assert [alarm.code for alarm in locked.alarms.open()] == ["pin_guessed"]
    locked.access = locked.again()
    assert locked.alarms.open()[0].count == 1


def test_removing_the_pin_ends_the_waiting(locked):
    guess(locked, 8)
    locked.access.check("0000")
    assert locked.access.remove()
    locked.access.set_pin("4711")
    assert locked.access.check("4711").is_right


def test_a_right_one_makes_the_count_start_again(locked):
    for _n in range(3):
        for _m in range(TRIES - 1):
            assert not locked.access.check("1111").is_right
        assert locked.access.check("4711").is_right


def test_it_can_be_read_nowhere(door, caplog):
    caplog.set_level(logging.DEBUG)
    door.access.set_pin("80417263")
    door.access.check("80417264")
    stored = door.db.read().execute("SELECT value FROM settings WHERE name = ?", (access.PIN,)).fetchone()["value"]
    digest = door.access._stored()["hash"]
    exported = configuration.export_configuration(door.db.read())
    for text in (exported, caplog.text, str(SettingsRepository().load(door.db.read()))):
        assert "8041726" not in text
        assert digest not in text
        assert "pin" not in text.replace("spinning", "").split()
    assert "8041726" not in stored


def test_two_tablets_with_one_pin_keep_different_hashes(locked):
    first = locked.access._stored()
    locked.access.set_pin("4711")
    second = locked.access._stored()
    assert first["salt"] != second["salt"]
    assert first["hash"] != second["hash"]


@pytest.mark.parametrize(
    ("pin", "is_easy"),
    [
        ("1234", True),
        ("123456", True),
        ("654321", True),
        ("0000", True),
        ("890123", True),
        ("4711", False),
        ("131313", False),
    ],
)
def test_runs_and_repetitions_are_easy_to_guess(pin, is_easy):
    assert is_easy_to_guess(pin) is is_easy
