"""No English inside another language: what the services store of problems and reasons is shown in the language of the screen."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.backups import back_up, restore
from app.database.check_ups import CheckUpRepository
from app.database.errors import translated
from app.domain.check_up import LeftBehind
from app.domain.models import Alarm, Group, Priority, Robot, State
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
from app.services.live.tablet_zone import TabletZone
from mir_sim.control import COMMANDS
from mir_sim.state import RobotError
from tests.support.expected_findings import checked_up
from tests.support.network import Fate
from tests.support.site import GUIDS, PASSWORD, USER, Site

FINNISH = translation("fi").gettext
PLACEHOLDER = re.compile(r"({[^}]*})")
START = "2026-11-23T06:05"
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
def robot_error(site, plan):
    site.machines["R1"].raise_error(RobotError(7, "Left wheel"), lasting=True)
    site.run(120)


def emergency_stop(site, plan):
    site.machines["R1"].press_emergency_stop(True)
    site.run(60)


def unreachable(site, plan):
    site.network.down.add("R1")
    site.run(120)


def unauthorized(site, plan):
    (robot,) = site.container.repositories.robots.all(site.container.db.read())
    site.container.catalogue.save_robot(robot, password="changed on the robot")
    site.switch_off()
    site.switch_on()
    site.run(60)


def not_a_robot(site, plan):
    site.network.rate, site.network.fates = 1.0, (Fate.PAGE,)
    site.run(120)


def wrong_robot(site, plan):
    site.run(60)
    site.machines["R1"].serial_number = "777"
    site.run(60)


def same_machine(site, plan):
    site.machines["R2"] = site.machines["R1"]
    site.container.catalogue.save_robot(Robot("R2", "http://r2", "distributor"), password="distributor")
    site.run(60)


def serial_hidden(site, plan):
    def hide(_where):
        raise SerialNumberHidden(address="R1", expected="A-1")

    site.network.interrupt = hide
    site.run(60)


def needs_password(site, plan):
    (robot,) = site.container.catalogue.robots()
    site.container.catalogue.save_robot(replace(robot, username="somebody else"))


def certificate_changed(site, plan):
    def refuse(_where):
        raise CertificateMismatch(address="R1")

    site.network.interrupt = refuse
    site.run(60)


def certificate_untrusted(site, plan):
    def refuse(_where):
        raise CertificateProblem(code="certificate_untrusted", address="R1")

    site.network.interrupt = refuse
    site.run(60)


def execution_failed(site, plan):
    site.container.catalogue.change_settings(retry_limit=2)
    plan(START, start_window_minutes=30)
    site.network.down.add("R1")
    site.run_until(lambda: site.executions(State.FAILED))


def execution_skipped(site, plan):
    site.machines["R1"].set_battery(12.0)
    plan(START, start_window_minutes=5, minimum_battery_percent=90.0)
    site.run_until(lambda: site.executions(State.SKIPPED))


def executions_missed(site, plan):
    plan(START, "FREQ=MINUTELY", respect_working_days=False)
    site.run(60)
    off(site, 86400)


def app_was_off(site, plan):
    site.run(60)
    off(site, 3600)


def backup_restored(site, plan):
    site.run(60)
    backup = site.directory / "before.db"
    back_up(site.container.db.path, backup)
    site.run(600)
    site.switch_off()
    restore(backup, site.container.db.path, site.clock.now())
    site.switch_on()
    site.run(30)


def off(site, seconds):
    site.switch_off()
    site.clock.advance(seconds)
    site.switch_on()
    site.run(30)


def start_refused(site, plan):
    """By the one robot of a group."""
    group = site.container.catalogue.save_group(Group("Hall", (1,)))
    site.container.catalogue.save_schedule(replace(plan(START), robot_id=None, group_id=group.id))
    site.machines["R1"].site.table("/missions").remove(GUIDS["Deliver"])
    site.run(330)


def robot_fails(site, plan):
    plan(START, recurrence="FREQ=MINUTELY;INTERVAL=10;COUNT=3")
    for _time in range(3):
        site.machines["R1"].fail_next = "Failed to reach goal position"
        site.run(600)
        site.machines["R1"].clear_errors()
        site.machines["R1"].resume()


def clock_stepped(site, plan):
    site.run(60)
    site.clock.step(-90)
    site.run(60)


def clock_implausible(site, plan):
    site.run(60)
    site.switch_off()
    site.clock.step(-86400)
    site.switch_on()
    site.run(60)


def chore_failed(site, plan):
    def fails():
        raise Unreachable(code="refused", address="R1")

    site.engine.add_chore("Planted", fails)
    site.run(60)


def two_tablets(site, plan):
    """The plan has moved to another tablet, and the old one is still on."""
    plan(START)
    site.switch_off()
    site.tablet = "another tablet"
    site.switch_on()
    site.container.tablet.move_here()
    site.run_until(lambda: site.executions(State.EXECUTING))
    (run,) = site.executions()
    enqueue(site, run.mission_guid, old_token(site.container.tablet.move, run))
    site.run(60)


def late_cancelled(site, plan):
    site.machines["R1"].pause()
    plan(START, start_window_minutes=1)
    site.network.next("POST", "/mission_queue", Fate.LATE, 200.0)
    site.run(600)


def adopted_unproven(site, plan):
    site.network.forgets_descriptions = True
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(400)


def unmarked_copy(site, plan):
    site.network.forgets_descriptions = True
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.LATE, 200.0)
    site.run(900)


def check_up_outdated(site, plan):
    site.run(60)
    (robot,) = site.container.repositories.robots.all(site.container.db.read())
    site.check_up(robot, checked_up("faithful", robot.serial_number, "3.1.0"))
    site.run(60)


def check_up_left(site, plan):
    site.run(60)
    (robot,) = site.container.repositories.robots.all(site.container.db.read())
    site.container.db.write(
        lambda c: CheckUpRepository().note_left_behind(c, robot.id, LeftBehind(robot.serial_number))
    )
    site.network.down.add("R1")
    site.container.check_ups.put_back_all([robot.id])


def item_unreadable(site, plan):
    plan(START)
    site.run(310)
    site.network.unreadable.add(("R1", 1))
    site.run(60)


def duplicate_healed(site, plan):
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.machines["R1"].pause()
    site.run(120)
    copy_of_the_run(site)
    site.run(60)


def duplicate_running(site, plan):
    plan(START)
    site.run_until(lambda: site.executions(State.COMPLETED))
    copy_of_the_run(site)
    site.run(35)


def started_twice(site, plan):
    """On a second robot, which is started here."""
    second = site.container.catalogue.save_robot(Robot("R2", "http://r2", USER), password=PASSWORD)
    site.network.down.add("R2")
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(302)
    site.container.operator.start_on_another(site.executions()[0].id, second.id)
    site.run(30)


def copy_of_the_run(site):
    (run,) = site.executions()
    enqueue(site, run.mission_guid, run.token)


def enqueue(site, mission_guid, token):
    (robot,) = site.container.repositories.robots.all(site.container.db.read())
    site.container.make_client(robot).enqueue(mission_guid, description=token)


def unknown_outcome(site, plan):
    plan(START, start_window_minutes=5)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.network.down.add("R1")
    site.run(600)


def database(site, plan):
    full = sqlite3.OperationalError("database or disk is full")
    full.sqlite_errorcode = sqlite3.SQLITE_FULL
    site.container.alarms.database_fails(translated(full, site.container.db.path).message)


def backup_failed(site, plan):
    (site.directory / "backups").write_text("in the way")
    backup = DailyBackup(site.container.db, site.clock, site.container.alarms)
    backup.run()
    backup.tick()


def pin_guessed(site, plan):
    site.container.access.set_pin("4711")
    for _n in range(ALARM_AFTER):
        site.clock.advance(site.container.access.check("0000").wait_s)


def lock_lost(site, plan):
    lock = InstanceLock(site.directory)
    lock.acquire()
    watch(site.container, lock)
    lock.path.unlink()
    site.run(60)


def too_few_files(site, plan):
    site.container.alarms.raise_("too_few_files", "app", **host.too_few_files(robots=400, allowed=1024))


def zone_guessed(site, plan):
    guess = TabletZone("Europe/Helsinki", "/etc/localtime", False)
    site.container.db.write(lambda c: site.container.repositories.settings.save(c, timezone="Mars/Base"))
    site.container.catalogue.edit(lambda edit: zones.take_known_zones(edit, lambda: guess))


def zone_unknown(site, plan):
    plan(START, "FREQ=DAILY")
    site.container.db.write(lambda c: c.execute("UPDATE schedules SET timezone = 'Mars/Base'"))
    zone_guessed(site, plan)


def question(site, plan):
    COMMANDS["user_prompt"]({"question": "Onko kuorma kunnossa?", "options": ["Kyllä", "Ei"], "timeout": 600})(
        site.machines["R1"]
    )
    site.run(60)


CAUSES: dict[str, Callable[..., None]] = {
    cause.__name__: cause
    for cause in (
        robot_error,
        emergency_stop,
        unreachable,
        unauthorized,
        not_a_robot,
        wrong_robot,
        same_machine,
        serial_hidden,
        certificate_changed,
        certificate_untrusted,
        needs_password,
        execution_failed,
        start_refused,
        robot_fails,
        execution_skipped,
        executions_missed,
        app_was_off,
        backup_restored,
        clock_stepped,
        clock_implausible,
        duplicate_healed,
        duplicate_running,
        started_twice,
        unknown_outcome,
        database,
        backup_failed,
        chore_failed,
        two_tablets,
        late_cancelled,
        adopted_unproven,
        unmarked_copy,
        check_up_outdated,
        check_up_left,
        item_unreadable,
        pin_guessed,
        lock_lost,
        too_few_files,
        zone_guessed,
        zone_unknown,
        question,
    )
}


def test_every_kind_of_alarm_is_brought_about_here():
    assert CAUSES.keys() == SENTENCES.keys()


@pytest.mark.parametrize("code", CAUSES)
def test_an_alarm_is_shown_completely_in_another_language(site, plan, code):
    CAUSES[code](site, plan)
    raised = [alarm for alarm in site.container.alarms.open() if alarm.code == code]
    assert raised
    for alarm in raised:
        assert readable(alarm_sentence(alarm, crossed), site, *ROBOTS_WORDS) == []
        assert "{" not in alarm_sentence(alarm, FINNISH)
        assert "msgid" not in alarm_sentence(alarm)  # as in the log


def only(site, code):
    (alarm,) = [alarm for alarm in site.container.alarms.open() if alarm.code == code]
    return alarm


def test_the_reason_of_a_failed_run_is_reported_with_its_problem(site, plan):
    execution_failed(site, plan)
    alarm = only(site, "execution_failed")
    assert alarm_sentence(alarm) == (
        "Deliver on R1 failed: Given up at attempt 3: r1 refused the connection; is the robot switched on and "
        "its address right?"
    )
    assert alarm_sentence(alarm, FINNISH).endswith("r1 ei ota yhteyttä vastaan; onko robotti päällä ja osoite oikein?")


def test_an_absence_is_reported_in_wall_time_of_the_tablet(site, plan, caplog):
    site.container.catalogue.change_settings(timezone="Europe/Helsinki")
    app_was_off(site, plan)
    alarm = only(site, "app_was_off")
    assert re.fullmatch(r"The app was off or asleep from 08:\d\d to 09:\d\d", alarm_sentence(alarm))
    assert re.search(r"08\.\d\d.+09\.\d\d", alarm_sentence(alarm, FINNISH))
    assert f"alarm: {alarm_sentence(alarm)}" in caplog.messages
    days = Alarm(
        alarm.code,
        alarm.key,
        alarm.priority,
        alarm.raised_at,
        {
            "start": "2026-11-23T21:30:00.123456+00:00",
            "end": "2026-11-23T23:00:00+00:00",
            "timezone": "Europe/Helsinki",
        },
    )
    assert alarm_sentence(days) == "The app was off or asleep from 2026-11-23 23:30 to 2026-11-24 01:00"


def test_times_in_the_reason_of_an_alarm_are_those_of_the_schedule(site, plan):
    execution_skipped(site, plan)
    alarm = only(site, "execution_skipped")
    assert alarm.details["timezone"] == "UTC"
    assert alarm_sentence(alarm) == "Deliver on R1 was not run: Battery 11.6 % stayed under 90 % until 06:10"
    there = Alarm(
        alarm.code, alarm.key, alarm.priority, alarm.raised_at, {**alarm.details, "timezone": "Europe/Helsinki"}
    )
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
def test_what_a_run_waits_for_and_why_it_ended_is_shown_completely(site, plan):
    plan(START, start_window_minutes=1)
    site.network.down.add("R1")
    site.run(302)
    (waiting,) = site.executions(State.WAITING)
    assert "refused the connection" in waiting_sentence(waiting)
    assert readable(waiting_sentence(waiting, translate=crossed), site) == []
    site.run(120)
    (ended,) = site.executions(State.FAILED)
    assert "refused the connection" in sentence(ended.reason, "UTC")
    assert readable(sentence(ended.reason, "UTC", crossed), site) == []


def test_the_robot_did_not_receive_it_is_reported_in_the_language_too(site, plan):
    plan(START, start_window_minutes=1)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(300 + 200)
    (ended,) = site.executions(State.FAILED)
    assert "the robot did not receive it" in sentence(ended.reason, "UTC")
    assert readable(sentence(ended.reason, "UTC", crossed), site) == []


def test_what_is_wrong_with_a_robot_is_kept_in_its_parts(site):
    site.network.down.add("R1")
    site.run(90)
    (robot,) = site.container.repositories.robots.all(site.container.db.read())
    assert site.container.snapshots.get(robot.id).problem == Unreachable(code="refused", address="r1").message


def test_a_problem_of_the_clock_says_both_times(site, plan):
    now = site.clock.now()
    site.run(60)
    site.network.down.add("R1")  # no robot can be asked
    clock_implausible(site, plan)
    yesterday, today = f"{now - timedelta(days=1):%Y-%m-%d}", f"{now:%Y-%m-%d}"
    assert yesterday in alarm_sentence(only(site, "clock_implausible"), FINNISH)
    assert today in alarm_sentence(only(site, "clock_implausible"), FINNISH)
