"""No English inside another language: what the services store of problems and reasons is shown in the language of the screen."""

from __future__ import annotations

import re
import sqlite3
from dataclasses import replace

import pytest

from app.database.check_ups import CheckUpRepository
from app.database.errors import translated
from app.domain.check_up import LeftBehind
from app.domain.execution import State
from app.domain.models import Alarm, Priority, Robot
from app.domain.reasons import sentence, waiting_sentence
from app.i18n import translation
from app.mir.errors import CertificateMismatch, CertificateProblem, SerialNumberHidden, Unreachable
from app.process import host
from app.process.data_directory import InstanceLock
from app.process.host import watch
from app.services.catalogue import zones
from app.services.files.daily_backup import DailyBackup
from app.services.live.access import ALARM_AFTER
from app.services.live.alarms import SENTENCES, alarm_sentence
from app.services.live.tablet import old_token
from app.services.live.tablet_troubles import Battery, Readings, Room, TabletTroubles
from app.services.live.tablet_zone import TabletZone
from mir_sim.control import COMMANDS
from mir_sim.state import RobotError
from tests.services.story import *
from tests.support.examples import every_fourth
from tests.support.expected_findings import checked_up
from tests.support.site import PASSWORD, USER, Site

FINNISH = translation("fi").gettext
PLACEHOLDER = re.compile(r"({[^}]*})")
ROBOTS_WORDS = (
    "Left wheel",
    "Internal server error",
    "Onko kuorma kunnossa?",  # what a robot says, it says in its own words
    "Europe",
    "Helsinki",
    "Mars",
    "Base",
)  # and zones have one name everywhere


def crossed(text: str) -> str:
    """The Finnish text with a cross for each letter: what can still be read afterwards was not translated. Names fill the placeholders."""
    if not text or (finnish := FINNISH(text)) == text:
        return text
    return "".join(
        part if part.startswith("{") else re.sub(r"[^\W\d_]", "×", part) for part in PLACEHOLDER.split(finnish)
    )


def readable(text: str, site: Site, *words: str) -> list[str]:
    """The remaining words, without the names of this site and ``words``."""
    text = re.sub(rf"{re.escape(str(site.directory))}[^\s:]*", "", text)
    for known in ("R1", "Deliver", "S1", "Hall", *words):
        text = text.replace(known, "")
    return re.findall(r"[A-Za-z]{2,}", text)


# ---------------------------------------------------------------------- how each alarm comes about
def raising(error):
    def call(*_values):
        raise error

    return call


@step
def robot_answers(s, error):
    s.network.interrupt = raising(error)


@step
def change_robot(s, password=None, **changes):
    s.container.catalogue.save_robot(replace(s.robot("R1"), **changes), password=password)


@step
def add_r2(s):
    s.container.catalogue.save_robot(Robot("R2", "http://r2", USER), password=PASSWORD)


@step
def queue_again(s, token_of=lambda s, row: row.token):
    """What the robot has of the newest start."""
    row = s.row()
    s.container.make_client(s.robot("R1")).enqueue(row.mission_guid, description=token_of(s, row))


@step
def move_to_another_tablet(s):
    s.switch_off()
    s.tablet = "another tablet"
    s.switch_on()
    s.container.tablet.move_here()


@step
def check_up_of_other_software(s):
    s.check_up(s.robot("R1"), checked_up("faithful", s.robot("R1").serial_number, "3.1.0"))


@step
def leave_check_up(s):
    left = LeftBehind(s.robot("R1").serial_number)
    s.container.db.write(lambda c: CheckUpRepository().note_left_behind(c, 1, left))
    s.network.down.add("R1")
    s.container.check_ups.put_back_all([1])


@step
def fill_database(s):
    full = sqlite3.OperationalError("database or disk is full")
    full.sqlite_errorcode = sqlite3.SQLITE_FULL
    s.container.alarms.database_fails(translated(full, s.container.db.path).message)


@step
def prevent_backup(s):
    (s.directory / "backups").write_text("in the way")
    DailyBackup(s.container.db, s.clock, s.container.alarms).run()


@step
def guess_pin(s):
    s.container.access.set_pin("4711")
    for _n in range(ALARM_AFTER):
        s.clock.advance(s.container.access.check("0000").wait_s)


@step
def lose_lock(s):
    lock = InstanceLock(s.directory)
    lock.acquire()
    watch(s.container, lock)
    lock.path.unlink()


@step
def tablet_in_trouble(s):
    """As if its disk were full, its battery empty, and no time server set its clock."""
    c = s.container
    readings = Readings(lambda: Room(0, 0), lambda: False, lambda: Battery(5, False), lambda: False)
    troubles = TabletTroubles(
        readings, clock=c.clock, alarms=c.alarms, snapshots=c.snapshots, tablet=c.tablet, robots=lambda: [1]
    )
    s.engine.add_chore("Watching the tablet", troubles.tick)


@step
def lose_zone(s):
    s.container.db.write(lambda c: c.execute("UPDATE schedules SET timezone = 'Mars/Base'"))


@step
def guess_zone(s):
    s.container.db.write(lambda c: s.container.repositories.settings.save(c, timezone="Mars/Base"))
    guess = TabletZone("Europe/Helsinki", "/etc/localtime", False)
    s.container.catalogue.edit(lambda edit: zones.take_known_zones(edit, lambda: guess))


def some(state):
    return until(lambda s: s.executions(state))


OFTEN = plan(rule="FREQ=MINUTELY", workdays=False)
FAIL = [do(lambda s: setattr(s.machines["R1"], "fail_next", "Failed to reach goal position")), 600]
MEND = [do(lambda s: s.machines["R1"].clear_errors()), robot_goes_on()]
YESTERDAY = [app_off(), do(lambda s: s.clock.step(-DAY)), app_on()]
FORGETS = do(lambda s: setattr(s.network, "forgets_descriptions", True))
ASK = COMMANDS["user_prompt"]({"question": "Onko kuorma kunnossa?", "options": ["Kyllä", "Ei"], "timeout": 600})
TOO_FEW_FILES = host.too_few_files(robots=400, allowed=1024)

CAUSES: dict[str, list] = {
    "robot_error": [do(lambda s: s.machines["R1"].raise_error(RobotError(7, "Left wheel"), lasting=True)), 120],
    "emergency_stop": [do(lambda s: s.machines["R1"].press_emergency_stop(True)), 60],
    "unreachable": [down(), 120],
    "unauthorized": [change_robot(password="changed on the robot"), app_off(), app_on(), 60],
    "not_a_robot": [meets("*", "*", Fate.PAGE, count=100), 120],
    "wrong_robot": [60, do(lambda s: setattr(s.machines["R1"], "serial_number", "777")), 60],
    "same_machine": [do(lambda s: s.machines.update(R2=s.machines["R1"])), add_r2(), 60],
    "serial_hidden": [robot_answers(SerialNumberHidden(address="R1", expected="A-1")), 60],
    "certificate_changed": [robot_answers(CertificateMismatch(address="R1")), 60],
    "certificate_untrusted": [robot_answers(CertificateProblem(code="certificate_untrusted", address="R1")), 60],
    "needs_password": [change_robot(username="somebody else")],
    "execution_failed": [set_up(retry_limit=2), plan(window=30), down(), some(FAILED)],
    "start_refused": [plan(robot_id=None, group_id=1), do(lambda s: s.lose_mission("R1")), 330],  # by all of a group
    "robot_fails": [plan(rule="FREQ=MINUTELY;INTERVAL=10;COUNT=3"), [FAIL, MEND] * 3],
    "execution_skipped": [battery(12.0), plan(window=5, battery=90.0), some(State.SKIPPED)],
    "executions_missed": [OFTEN, 60, off_for(DAY), 30],
    "app_was_off": [60, off_for(3600), 30],
    "backup_restored": [60, backup(), 600, restored(), 30],
    "clock_stepped": [60, clock(-90), 60],
    "clock_implausible": [60, YESTERDAY, 60],
    "duplicate_healed": [plan(), post(LOST), 306, robot_pauses(), 120, queue_again(), 60],
    "duplicate_running": [plan(), some(COMPLETED), queue_again(), 35],
    "started_twice": [
        [add_r2(), down("R2"), plan(), post(ANSWER_LOST), 302],
        [do(lambda s: s.container.operator.start_on_another(s.row().id, s.robot("R2").id)), 30],
    ],
    "unknown_outcome": [plan(window=5), post(LOST), 306, down(), 600],
    "database": [fill_database()],
    "backup_failed": [prevent_backup()],
    "chore_failed": [
        do(lambda s: s.engine.add_chore("Planted", raising(Unreachable(code="refused", address="R1")))),
        60,
    ],
    "two_tablets": [
        [plan(), move_to_another_tablet(), some(EXECUTING)],
        [queue_again(lambda s, row: old_token(s.container.tablet.move, row)), 60],
    ],
    "late_cancelled": [robot_pauses(), plan(window=1), post(LATE, 200.0), 600],
    "adopted_unproven": [FORGETS, plan(), post(ANSWER_LOST), 400],
    "unmarked_copy": [FORGETS, plan(), post(LATE, 200.0), 900],
    "check_up_outdated": [60, check_up_of_other_software(), 60],
    "check_up_left": [60, leave_check_up()],
    "item_unreadable": [plan(), 310, do(lambda s: s.network.unreadable.add(("R1", 1))), 60],
    "pin_guessed": [guess_pin()],
    "lock_lost": [lose_lock(), 60],
    "too_few_files": [do(lambda s: s.container.alarms.raise_("too_few_files", "app", **TOO_FEW_FILES))],
    "disk_nearly_full": [tablet_in_trouble(), 300, 300],
    "tablet_battery_low": [tablet_in_trouble(), 300, 300],
    "clock_not_synchronised": [tablet_in_trouble(), 1500],
    "network_lost": [down(), tablet_in_trouble(), 1200],
    "zone_guessed": [guess_zone()],
    "zone_unknown": [plan(rule="FREQ=DAILY"), lose_zone(), guess_zone()],
    "question": [do(lambda s: ASK(s.machines["R1"])), 60],
}


@pytest.fixture
def site(tmp_path):
    site = Stage(tmp_path, "robot", robots=1)
    play(site, POLLED_OFTEN)
    yield site
    site.switch_off()


def test_every_kind_of_alarm_is_brought_about_here():
    assert CAUSES.keys() == SENTENCES.keys()


@pytest.mark.parametrize("code", every_fourth(CAUSES))
def test_an_alarm_is_shown_completely_in_another_language(site, code):
    play(site, CAUSES[code])
    raised = [alarm for alarm in site.container.alarms.open() if alarm.code == code]
    assert raised
    for alarm in raised:
        assert readable(alarm_sentence(alarm, crossed), site, *ROBOTS_WORDS) == []
        assert "{" not in alarm_sentence(alarm, FINNISH)
        assert "msgid" not in alarm_sentence(alarm)  # as in the log


def only(site, code):
    (alarm,) = [alarm for alarm in site.container.alarms.open() if alarm.code == code]
    return alarm


def test_the_reason_of_a_failed_run_is_reported_with_its_problem(site):
    play(site, CAUSES["execution_failed"])
    alarm = only(site, "execution_failed")
    assert alarm_sentence(alarm) == (
        "Deliver on R1 failed: Given up at attempt 3: r1 refused the connection. Is it switched on and "
        "its address right?"
    )
    assert alarm_sentence(alarm, FINNISH).endswith("r1 ei ota yhteyttä vastaan. Onko laite päällä ja osoite oikein?")


def test_an_absence_is_reported_in_wall_time_of_the_tablet(site, caplog):
    site.container.catalogue.change_settings(timezone="Europe/Helsinki")
    play(site, CAUSES["app_was_off"])
    alarm = only(site, "app_was_off")
    assert re.fullmatch(r"The app was off or asleep from 08:\d\d to 09:\d\d", alarm_sentence(alarm))
    assert re.search(r"08\.\d\d.+09\.\d\d", alarm_sentence(alarm, FINNISH))
    assert f"alarm: {alarm_sentence(alarm)}" in caplog.messages
    night = {"start": "2026-11-23T21:30:00.123456+00:00", "end": "2026-11-23T23:00:00+00:00"}
    days = replace(alarm, details={**alarm.details, **night})
    assert alarm_sentence(days) == "The app was off or asleep from 2026-11-23 23:30 to 2026-11-24 01:00"


def test_times_in_the_reason_of_an_alarm_are_those_of_the_schedule(site):
    play(site, CAUSES["execution_skipped"])
    alarm = only(site, "execution_skipped")
    assert alarm.details["timezone"] == "UTC"
    assert alarm_sentence(alarm) == "Deliver on R1 was not run: Battery 11.6 % stayed under 90 % until 06:10"
    there = replace(alarm, details={**alarm.details, "timezone": "Europe/Helsinki"})
    assert alarm_sentence(there).endswith("until 08:10")


def test_what_an_older_version_stored_is_shown_as_it_is(site):
    for details in (
        {"reason": "The robot refused it", "problem": "no answer"},
        {"reason": {"code": "unheard_of"}, "problem": None},
    ):
        for code in ("execution_failed", "unreachable"):
            alarm = Alarm(
                code, "robot:1", Priority.LOW, site.clock.now(), {"robot": "R1", "mission": "Deliver", **details}
            )
            sentence = alarm_sentence(alarm, FINNISH)
            assert sentence.startswith("R1") or "Deliver" in sentence
            assert ("The robot refused it" in sentence or "unheard_of" in sentence) is (code == "execution_failed")


# ---------------------------------------------------------------------- runs and robots
def test_what_a_run_waits_for_and_why_it_ended_is_shown_completely(site):
    play(site, plan(window=1), down(), 302)
    waiting = site.row()
    assert "refused the connection" in waiting_sentence(waiting)
    assert readable(waiting_sentence(waiting, translate=crossed), site) == []
    play(site, 120, states(FAILED))
    ended = site.row().reason
    assert "refused the connection" in sentence(ended, "UTC")
    assert readable(sentence(ended, "UTC", crossed), site) == []


def test_the_robot_did_not_receive_it_is_reported_in_the_language_too(site):
    play(site, plan(window=1), post(LOST), 500, states(FAILED))
    ended = site.row().reason
    assert "the robot did not receive it" in sentence(ended, "UTC")
    assert readable(sentence(ended, "UTC", crossed), site) == []


def test_what_is_wrong_with_a_robot_is_kept_in_its_parts(site):
    play(site, down(), 90)
    assert site.container.snapshots.get(1).problem == Unreachable(code="refused", address="r1").message


def test_a_problem_of_the_clock_says_both_times(site):
    play(site, 60, down(), CAUSES["clock_implausible"])  # no robot can be asked
    said = alarm_sentence(only(site, "clock_implausible"), FINNISH)
    assert "2026-11-22" in said
    assert "2026-11-23" in said
