"""A robot that reports more than a person can read: its reports are counted, and push nothing else out of the log or
the alarm list."""

from __future__ import annotations

import logging
import threading
from datetime import timedelta

import pytest

from app.database.alarms import OPEN_OF_A_KIND
from app.domain.models import Alarm
from app.process import log_file as logs
from app.services.live.alarms import KEPT, alarm_sentence
from tests.support.examples import at_night
from tests.support.log import file_in, kept_apart, written
from tests.support.site import Site

LONGEST_ALARM, LONGEST_LINE = 300, 2000


@pytest.fixture
def log_directory(tmp_path, monkeypatch):
    with kept_apart(monkeypatch):
        logs.start(tmp_path / "logs", stderr=False)
        yield tmp_path / "logs"


def only_alarm(site: Site) -> Alarm:
    [alarm] = site.container.alarms.open()
    return alarm


def test_hundreds_of_errors_make_one_short_alarm(site):
    for number in range(400):  # in 200 KiB: a longer status is not read
        site.machines["R1"].raise_error(_error(number), lasting=True)
    site.run(10.0)
    sentence = alarm_sentence(only_alarm(site))
    assert len(sentence) <= LONGEST_ALARM + len("R1: ")
    assert sentence.endswith("… and 399 more")  # one long description fills it


def test_no_detail_of_an_alarm_is_long(site):
    site.container.alarms.raise_("robot_error", "robot:1", robot="R1", problem="x" * 100_000)
    site.container.alarms.raise_(
        "unreachable", "robot:1", robot="R1", problem={"msgid": "{reason}", "params": {"reason": "y" * 100_000}}
    )
    parts = {"parts": ["z" * 100_000] * 2}
    site.container.alarms.raise_("not_a_robot", "robot:1", robot="R1", problem={"msgid": "{parts}", "params": parts})
    assert all(len(alarm_sentence(alarm)) < 3 * LONGEST_ALARM for alarm in site.container.alarms.open())


@pytest.mark.parametrize(
    ("others", "flood", "about"),
    [
        (100, lambda number: ("unreachable", "robot:1"), {}),
        (1, lambda number: ("unknown_outcome", f"execution:{number}"), {"robot_id": 1}),
    ],
    ids=["a condition that came again and again", "an alarm of each run"],
)
def test_alarms_of_one_kind_do_not_push_the_others_out_of_the_list(site, others, flood, about):
    """Each was acknowledged."""

    def fill(c):
        for number in range(KEPT + 500):
            at = site.clock.now() + timedelta(seconds=number)
            code, key = ("executions_missed", f"gap:{number}") if number < others else flood(number)
            details = {} if number < others else about
            site.container.repositories.alarms.raise_once(
                c, Alarm(code, key, "medium", at, details, last_at=at, cleared_at=at)
            )
            c.execute("UPDATE alarms SET acknowledged_at = cleared_at")

    site.container.db.write(fill)
    site.container.alarms.prune()
    past, total = site.container.alarms.past(KEPT)
    assert total == KEPT
    assert sum(alarm.code == "executions_missed" for alarm in past) == others


def test_unacknowledged_alarms_are_counted_and_stay_short(site):
    alarms = site.container.alarms
    alarms.raise_("unknown_outcome", "execution:0", robot="R2", robot_id=2, mission="M", problem="none")
    for number in range(1, 501):
        alarms.raise_("unknown_outcome", f"execution:{number}", robot="R1", robot_id=1, mission="M", problem="none")
    found = [alarm for alarm in alarms.open() if alarm.details["robot_id"] == 1]
    assert len(found) == OPEN_OF_A_KIND
    assert sum(alarm.count for alarm in found) == 500
    assert found[0].key == "execution:500"  # the newest leads to its own run
    assert "execution:1" in [alarm.key for alarm in found]
    assert "execution:0" in [alarm.key for alarm in alarms.open()]
    hidden = found[0]
    alarms.shelve(hidden.id, 8)
    alarms.raise_("unknown_outcome", "execution:501", robot="R1", robot_id=1, mission="M", problem="none")
    shown = {alarm.key: alarm for alarm in alarms.open()}
    assert shown["execution:501"].shelved_until is None, "no new event hides behind a shelved one"
    assert shown["execution:500"].count == hidden.count


def test_no_line_of_the_log_is_long(log_directory):
    logging.getLogger("app").warning("alarm: %s", "z" * 500_000)
    try:
        raise ValueError("q" * 500_000)
    except ValueError:
        logging.getLogger("app").exception("It broke")
    line, crash = file_in(log_directory).splitlines()
    assert len(line.encode()) <= LONGEST_LINE + 200
    assert "Traceback" in crash
    assert len(crash.encode()) <= logs.LONGEST_TRACE + 200


def test_a_robot_that_makes_lines_all_day_does_not_fill_the_log(log_directory):
    log = logging.getLogger("app")
    log.warning("evidence")

    def rave():
        for number in range(2_000):
            log.warning("R1: %d %s", number, "w" * 300)

    threads = [threading.Thread(target=rave, name=f"worker-R{number}") for number in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [path.name for path in log_directory.iterdir()] == [logs.FILE_NAME]
    content = file_in(log_directory)
    assert "evidence" in content
    assert len(content) < 3 * (logs.BURST + 10_000)


def test_lines_left_out_of_the_log_are_counted(log_directory, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(logs, "monotonic", lambda: now[0])
    log = logging.getLogger("app")

    def rave(times):
        thread = threading.Thread(target=lambda: [log.warning("w" * 1000) for _ in range(times)], name="worker-R1")
        thread.start()
        thread.join()

    rave(200)
    written = len(file_in(log_directory).splitlines())
    now[0] += 3600.0
    rave(1)
    last = file_in(log_directory).splitlines()[-1]
    assert last.endswith(f" (before it {200 - written} lines of this robot were left out)")


def _error(number: int):
    from mir_sim.state import RobotError

    return RobotError(10_000 + number, f"{number} " + "x" * 490, "Wheels")


@pytest.mark.parametrize(
    "text", ["\u202e\n" * 150, *at_night("w" * 1900, "車輪" * 300)], ids=["escaped", "ASCII", "three bytes each"]
)
def test_a_day_of_twelve_raving_robots_leaves_what_was_said_of_the_others(log_directory, monkeypatch, text):
    seconds = 0
    monkeypatch.setattr(logs, "monotonic", lambda: float(seconds))

    def say(thread: str, message: str, exc_info: object = None) -> None:
        record = logging.makeLogRecord(
            {
                "name": "app",
                "levelno": logging.WARNING,
                "levelname": "WARNING",
                "msg": message,
                "threadName": thread,
                "exc_info": exc_info,
            }
        )
        logging.getLogger().handle(record)

    for seconds in range(0, 24 * 3600, 240):
        for robot in range(12):
            say(f"worker-R{robot}", text)
        say("worker-calm", f"evidence of a robot {seconds}")
        say("scheduler", f"evidence of the app {seconds}")
        written()  # a day takes longer than this: the queue never fills
    files = list(log_directory.iterdir())
    kept = "".join(file.read_text(encoding="utf-8") for file in files)
    assert sum(file.stat().st_size for file in files) <= logs.BYTES * (logs.FILES + 1)
    assert kept.count("evidence of a robot") == kept.count("evidence of the app") == 24 * 15
    assert "lines of this robot were left out" in kept
