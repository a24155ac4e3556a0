"""When the tablet's clock is believed: at the start, after a jump, and against the robots' clocks."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

from app.database.connection import Database
from app.database.settings import CLOCK_CONFIRMED_AT, SettingsRepository
from app.database.values import to_text
from app.services.dispatch.clock_guard import ClockGuard, Judgement
from app.services.dispatch.observation import ClockReading
from app.services.dispatch.timing import FIRST_DOUBT
from app.services.live.alarms import Alarms
from app.services.live.changes import Changes
from app.services.live.downtime import Downtime
from app.services.live.holds import Holds
from tests.support.clock import VirtualClock

NOW = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
YESTERDAY, TOMORROW = NOW - timedelta(days=1), NOW + timedelta(days=1)
HOUR = 3600.0


class Tablet:
    """A guard on a virtual clock, and what it reported."""

    def __init__(self, path) -> None:
        self.clock, changes = VirtualClock(NOW), Changes()
        self.db = Database.open(path / "a.db", clock=self.clock, threaded=False, durable=False)
        self.settings, self.downtime = SettingsRepository(), Downtime()
        self.holds = Holds(self.db, self.clock, changes)
        self.alarms = Alarms(self.db, self.clock, changes)
        self.guard = self.restart()

    def restart(self, heartbeat: datetime | None = None) -> ClockGuard:
        if heartbeat is not None:
            self.db.write(lambda c: self.settings.set_heartbeat(c, heartbeat))
        self.guard = ClockGuard(self.db, self.clock, self.holds, self.alarms, self.downtime)
        self.guard.start()
        return self.guard

    def judge(self, *offsets: float, can_ask: bool = True, read_ago: float = 0.0) -> Judgement:
        """A round in which robots' clocks have just been read; s by which each is ahead of the tablet's."""
        read_at = self.clock.monotonic() - read_ago
        judgement = self.guard.judge(
            {number: ClockReading(offset, read_at) for number, offset in enumerate(offsets)}, can_ask
        )
        if judgement.is_trusted:
            self.guard.acted()
        return judgement

    def problem(self) -> str:
        hold = self.holds.active()
        return hold.reason if hold else ""

    def codes(self) -> list[str]:
        return [alarm.code for alarm in self.alarms.open()]


@pytest.fixture
def tablet(tmp_path):
    tablet = Tablet(tmp_path)
    yield tablet
    tablet.db.close()


# ---------------------------------------------------------------------- at the start
@pytest.mark.parametrize(
    ("heartbeat", "offsets", "is_trusted"),
    [
        (None, [], True),
        (YESTERDAY, [], True),
        (TOMORROW, [], False),
        (NOW + timedelta(seconds=30), [], True),  # a few seconds lost over a restart
        (TOMORROW, [1.0], True),  # a robot's time agrees
        (YESTERDAY, [HOUR], False),  # until one has agreed, one that differs counts
        (YESTERDAY, [HOUR, HOUR + 1], False),
        (YESTERDAY, [HOUR, 1.0], True),  # no majority
        (YESTERDAY, [-HOUR, -HOUR, 1.0], False),
        (YESTERDAY, [599.0, -599.0], True),
    ],
)
def test_when_the_tablets_clock_is_believed_at_the_start(tablet, heartbeat, offsets, is_trusted):
    tablet.restart(heartbeat)
    assert tablet.judge(*offsets, can_ask=False).is_trusted is is_trusted
    assert (tablet.holds.active() is None) is is_trusted
    assert ("clock_implausible" in tablet.codes()) is not is_trusted


def test_the_clock_is_not_trusted_before_a_robot_reported_its_time(tablet):
    assert not tablet.judge().is_trusted
    assert tablet.holds.active().clock
    assert tablet.codes() == []  # no trouble yet
    tablet.clock.advance(FIRST_DOUBT - 1)
    assert not tablet.judge().is_trusted
    assert tablet.judge(1.0).is_trusted
    assert tablet.holds.active() is None


def test_where_no_robot_can_be_asked_half_a_minute_is_waited_at_most(tablet):
    tablet.judge()
    tablet.clock.advance(FIRST_DOUBT)
    assert tablet.judge().is_trusted


def test_answers_from_before_the_doubt_do_not_end_it(tablet):
    assert not tablet.judge(1.0, read_ago=1.0).is_trusted


@pytest.mark.parametrize("step", [2 * HOUR, -2 * HOUR])
def test_answers_from_before_the_clock_was_set_do_not_end_the_doubt(tablet, step):
    tablet.clock.advance(1.0)  # robots answer, and the first round is late
    tablet.clock.step(step)
    tablet.clock.advance(1.0)
    assert not tablet.judge(0.0, 0.0, read_ago=1.5).is_trusted
    tablet.clock.advance(1.0)
    assert not tablet.judge(-step, -step).is_trusted
    assert "clock_implausible" in tablet.codes()


def test_while_it_is_in_doubt_no_heartbeat_is_written(tablet):
    tablet.restart(TOMORROW)
    tablet.judge(can_ask=False)
    tablet.guard.stop()
    assert tablet.settings.heartbeat(tablet.db.read()) == TOMORROW
    tablet.judge(0.0)
    tablet.guard.stop()
    assert tablet.settings.heartbeat(tablet.db.read()) == NOW


def test_the_sentence_says_when_the_app_ran_later_than_now(tablet):
    tablet.restart(TOMORROW)
    tablet.judge(can_ask=False)
    assert "the app already ran on 2026-11-24 12:00" in tablet.problem()


# ---------------------------------------------------------------------- later
def test_once_it_is_proven_one_robot_alone_brings_it_into_no_doubt(tablet):
    assert tablet.judge(0.0).is_trusted
    assert tablet.judge(HOUR).is_trusted
    assert tablet.judge(HOUR, HOUR, 0.0, 0.0).is_trusted
    assert not tablet.judge(HOUR, HOUR).is_trusted
    assert tablet.codes() == ["clock_implausible"]
    assert tablet.judge(0.0, 0.0).is_trusted
    assert tablet.alarms.open() == [] or all(alarm.cleared_at for alarm in tablet.alarms.open())


@pytest.mark.parametrize(("jump", "is_trusted"), [(14 * 60, True), (16 * 60, False), (3 * 86400, False)])
def test_a_jump_ahead_beyond_a_start_window_is_doubted(tablet, jump, is_trusted):
    tablet.judge(0.0)
    tablet.clock.step(jump)
    assert tablet.judge(0.0, read_ago=1.0).is_trusted is is_trusted


def test_an_answer_at_the_moment_of_a_jump_proves_nothing(tablet):
    tablet.judge(0.0)
    tablet.clock.step(8163.0)
    assert not tablet.judge(-370.0).is_trusted


def test_a_jump_ahead_with_which_a_robot_agrees_was_an_absence(tablet):
    tablet.judge(0.0)
    tablet.clock.step(HOUR)
    assert tablet.judge() == Judgement(False)
    tablet.clock.advance(1.0)
    assert tablet.judge(0.0).absent_since == NOW
    assert tablet.codes() == ["app_was_off"]
    assert tablet.downtime.at(NOW + timedelta(minutes=30)) is not None
    assert tablet.judge(0.0).absent_since is None


def test_a_jump_ahead_that_robots_contradict_is_doubted_until_reverted(tablet):
    tablet.judge(0.0)
    tablet.clock.step(HOUR)
    for _ in range(100):
        tablet.clock.advance(1.0)
        assert not tablet.judge(-HOUR).is_trusted
    assert tablet.codes() == ["clock_implausible"]
    tablet.clock.step(-HOUR)
    assert tablet.judge(0.0, read_ago=-1.0) == Judgement(True, NOW, went_back=True)
    assert "app_was_off" not in tablet.codes()


def test_a_clock_that_falls_back_to_before_the_app_existed_is_doubted_until_it_is_right(tablet):
    tablet.judge(0.0)
    tablet.clock.step(-400 * 24 * HOUR)
    assert tablet.judge(0.0) == Judgement(False)  # a time that a robot said before proves nothing
    assert tablet.judge() == Judgement(False)
    tablet.clock.advance(1.0)
    tablet.clock.step(400 * 24 * HOUR)
    assert tablet.judge(0.0) == Judgement(False)
    tablet.clock.advance(1.0)
    assert tablet.judge(0.0).is_trusted


def test_after_a_step_back_instants_may_come_again_once(tablet):
    tablet.judge(0.0)
    tablet.clock.step(-60.0)
    set_back = tablet.judge(0.0)
    assert (set_back.is_trusted, set_back.went_back, round(set_back.step.total_seconds())) == (True, True, -60)
    assert tablet.judge(0.0) == Judgement(True)
    assert tablet.codes() == ["clock_stepped"]


def test_a_short_restart_is_no_absence_and_a_long_one_is(tablet):
    tablet.restart(NOW - timedelta(seconds=45))
    assert tablet.judge(0.0).absent_since is None
    tablet.restart(YESTERDAY)
    assert tablet.judge(0.0).absent_since == YESTERDAY


def overrule(tablet):
    """Two robots of three bring the clock into doubt, and a person decides against them."""
    tablet.judge(0.0)
    assert not tablet.judge(0.0, HOUR, HOUR).is_trusted
    tablet.holds.confirm_clock()
    assert tablet.judge(0.0, HOUR, HOUR).is_trusted


def test_robots_overruled_by_a_person_cannot_hold_the_plant_by_a_new_difference(tablet, caplog):
    overrule(tablet)
    assert "decided against the clocks of robots #1, #2" in caplog.text
    for hours in (2, -5, 0, 1, 300):
        tablet.clock.advance(60.0)
        assert tablet.judge(0.0, hours * HOUR, hours * HOUR).is_trusted
    assert tablet.judge(2 * HOUR, HOUR, 0.0).is_trusted  # one other alone


def test_others_still_can(tablet):
    overrule(tablet)
    assert not tablet.judge(HOUR, 2 * HOUR, 2 * HOUR, HOUR).is_trusted


def test_clocks_count_again_after_an_hour_without_difference(tablet):
    overrule(tablet)
    tablet.clock.advance(HOUR)
    assert tablet.judge(0.0, 2 * HOUR, 2 * HOUR).is_trusted
    tablet.clock.advance(HOUR + 1)
    assert tablet.judge(0.0, 0.0, 0.0).is_trusted
    assert not tablet.judge(0.0, 2 * HOUR, 2 * HOUR).is_trusted


def test_clocks_count_at_once_when_the_tablets_clock_steps(tablet):
    overrule(tablet)
    tablet.clock.step(-HOUR)
    assert not tablet.judge(HOUR, 2 * HOUR, 2 * HOUR).is_trusted


def test_a_person_can_say_that_the_clock_is_right_whatever_robots_say(tablet):
    """It stays trusted while the robots' clocks differ as they did then."""
    assert not tablet.judge(HOUR, HOUR).is_trusted
    tablet.holds.confirm_clock()
    assert tablet.judge(HOUR, HOUR).is_trusted
    tablet.restart()
    assert tablet.judge(HOUR + 1, HOUR - 1).is_trusted
    assert not tablet.judge(2 * HOUR, 2 * HOUR).is_trusted


@pytest.mark.parametrize(
    ("offsets", "sentence"),
    [
        ((HOUR,), "the robot's clock is 60 min ahead of it"),
        ((-HOUR,), "the robot's clock is 60 min behind it"),
        ((HOUR, HOUR), "most robots' clocks are 60 min ahead of it"),
        ((0.0, -HOUR, -HOUR), "most robots' clocks are 60 min behind it"),
    ],
)
def test_differing_clocks_are_named(tablet, offsets, sentence):
    tablet.judge(*offsets)
    assert tablet.problem() == sentence


def confirm(tablet, ago: timedelta, heartbeat: datetime | None = None) -> None:
    """As the command does while no app runs; then it starts."""
    tablet.db.write(lambda c: tablet.settings.put(c, CLOCK_CONFIRMED_AT, to_text(NOW - ago)))
    tablet.restart(heartbeat)


def test_answers_from_before_the_start_end_the_first_doubt(tablet):
    confirm(tablet, timedelta(hours=23))
    assert tablet.judge(HOUR).is_trusted
    tablet.restart()
    assert tablet.judge(HOUR).is_trusted  # the state then
    assert not tablet.judge(2 * HOUR, 2 * HOUR).is_trusted


def test_it_ends_that_of_a_clock_before_the_last_run_too(tablet):
    confirm(tablet, timedelta(minutes=1), TOMORROW)
    assert tablet.judge(can_ask=False).is_trusted


@pytest.mark.parametrize("ago", [timedelta(hours=25), timedelta(minutes=-1)])
def test_old_answers_and_those_of_another_clock_do_not_count(tablet, ago):
    confirm(tablet, ago)
    assert not tablet.judge(HOUR).is_trusted


def test_a_confirmed_difference_ends_at_a_start_with_agreeing_clocks(tablet):
    confirm(tablet, timedelta(hours=1))
    assert tablet.judge(0.0).is_trusted
    tablet.restart()
    assert not tablet.judge(HOUR).is_trusted
