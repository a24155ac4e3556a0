"""What healthy robots and the person at the tablet notice while hostile robots are polled and hostile files are
imported, all at once.

    SDL_VIDEODRIVER=offscreen uv run python -m tests.benchmarks.bench_hostile [seconds]

The window shows Home with each of the hostile robots in turn, and then the Logs; ten healthy robots get 10 missions a
second between them; each of ``hostile_robots`` is polled every 2 s; a second after each import of a file the next one
begins, which is as quick as commands are. Printed (for the first showing of everything, the second, and then with the
hostile robots): how late missions came, how long frames took, how much memory grew; and at the end whether what was in
the log and in the alarm list before is still there. Exits with 1 where missions beside hostile robots come too late, or some do
not come at all.
"""

from __future__ import annotations

import gc
import json
import logging
import resource
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from datetime import UTC, datetime
from itertools import cycle
from pathlib import Path
from typing import Any

from tests.benchmarks.bench_dispatch import Scenario, stub
from tests.benchmarks.bench_frames import Frames
from tests.benchmarks.stub import MISSION_GUID, address
from tests.integration.mir.servers import FIELD, pin_of
from tests.screenshots.registry import LANDSCAPE
from tests.screenshots.studio import open_window

HEALTHY = Scenario(10, 0, 0.0, 0.0, 0)
A_SECOND = 10  # missions
LATEST = 150.0  # ms late, p99
EVIDENCE = "what happened before the attack"


def hostile() -> tuple[subprocess.Popen[str], dict[str, str]]:
    """The process, and its addresses by fate."""
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.benchmarks.hostile_robots"], stdout=subprocess.PIPE, text=True
    )
    addresses = {}
    while (line := process.stdout.readline()) not in ("ready\n", ""):
        address_, fate = line.rstrip().split(" ", 1)
        addresses[fate] = address_
    return process, addresses


def files(directory: Path) -> list[Path]:
    """A calendar of some lines that stands for all days, and configurations that are long, deep, or about nothing known."""
    months = ",".join(map(str, range(1, 13)))
    rule = f"BEGIN:VEVENT\r\nDTSTART;VALUE=DATE:20260101\r\nRRULE:FREQ=YEARLY;BYMONTH={months};BYDAY=MO,TU,WE,TH,FR,SA,SU\r\nEND:VEVENT\r\n"
    schedule = {"robot": "R0", "mission": "Deliver", "start": "2030-01-01T06:00"}
    contents = {
        "bomb.ics": f"BEGIN:VCALENDAR\r\n{rule * 60}END:VCALENDAR\r\n",
        "long.json": json.dumps({"format": "amr-scheduler/1", "schedules": [schedule] * 2_000}),
        "deep.json": "[" * 1_000_000,
        "keys.json": "{" + ",".join('"robots": []' for _ in range(100_000)) + "}",
    }
    for name, content in contents.items():
        (directory / name).write_text(content, encoding="utf-8")
    return [directory / name for name in contents]


def megabytes() -> float:
    """In memory, without garbage that is still to be collected."""
    gc.collect()
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmRSS"))


def lateness(out: Path, due: dict[str, float]) -> list[float]:
    """ms, ascending."""
    posts = [line.split(",", 2) for line in out.read_text(encoding="utf-8").splitlines()]
    return sorted((float(at) - due[name]) * 1000 for at, _robot, name in posts if name in due)


def main() -> None:
    seconds = next((float(word) for word in sys.argv[1:] if word[0].isdigit()), 40.0)
    open_window(LANDSCAPE)
    from app.container import Container
    from app.domain.models import Mission, Robot, Schedule
    from app.mir.credentials import Token
    from app.process import log_file
    from app.services.catalogue import configuration
    from app.window.application import SchedulerApp
    from app.window.window import quiet_garbage

    attackers, addresses = hostile()
    pin = pin_of(FIELD)
    planned: dict[str, dict[str, float]] = {"first ": {}, "": {}, "attack ": {}}
    with tempfile.TemporaryDirectory() as directory:
        base = Path(directory)
        log_file.start(base / "logs", stderr=False)
        logging.getLogger("app").warning(EVIDENCE)
        with stub(HEALTHY, base / "posts.csv") as port, quiet_garbage():
            container = Container.open(base / "data", with_window=True)
            r, now = container.repositories, container.clock.now()
            token = Token.derive("distributor", "distributor").header
            far = now.replace(year=now.year + 1, second=0, microsecond=0)
            container.db.write(
                lambda c: [
                    r.robots.add(c, Robot(f"R{n}", f"http://{address(n)}:{port}", "distributor", token))
                    for n in range(HEALTHY.robots)
                ]
            )
            mission = container.db.write(lambda c: r.missions.add(c, Mission("Deliver", MISSION_GUID)))
            robots = r.robots.all(container.db.read())
            container.catalogue.change_settings(poll_interval_seconds=2, selected_robot_id=robots[0].id)
            container.alarms.raise_("executions_missed", "evidence", count=1)
            container.runner.start()
            app = SchedulerApp(container)
            app._run_prepare()
            frames = Frames()

            def phase(name: str, title: str, screens: list[str], shown: list[Robot]) -> None:
                begin, count, turn = time.time() + 5.0, int((seconds - 8.0) * A_SECOND), cycle(robots)
                due = planned[name] = {f"{name}{n}": begin + n / A_SECOND for n in range(count)}
                container.db.write(
                    lambda c: [
                        r.schedules.add(
                            c,
                            Schedule(
                                each,
                                next(turn).id,
                                mission.id,
                                far.replace(tzinfo=None),
                                "UTC",
                                "FREQ=YEARLY",
                                respect_working_days=False,
                                changed_at=now,
                                next_at=datetime.fromtimestamp(at, UTC),
                            ),
                        )
                        for each, at in due.items()
                    ]
                )
                container.runner.wake()
                before, drawn, worst = megabytes(), [], dict[str, float]()
                for screen in screens:
                    app.shell.go(screen)
                    turns = shown if screen == "home" else shown[:1]
                    for selected in turns:
                        container.catalogue.change_settings(selected_robot_id=selected.id)
                        if screen == "home":
                            app.shell.go(screen, robot_id=selected.id)
                        found = frames.run(seconds / len(screens) / len(turns))
                        drawn += found
                        worst[f"{screen}, {selected.name}"] = max(frame.wall for frame in found)
                wall = sorted(frame.wall for frame in drawn)
                print(
                    f"{title:<24} frames p50 {wall[len(wall) // 2]:.1f} p99 {wall[int(0.99 * len(wall))]:.1f} max {wall[-1]:.1f} ms; "
                    f"memory {megabytes() - before:+.0f} MiB",
                    flush=True,
                )
                longest = sorted(worst.items(), key=lambda entry: -entry[1])[:3]
                print("  longest on " + "; ".join(f"{name}: {ms:.0f} ms" for name, ms in longest), flush=True)

            phase("first ", "screens, rows are built", ["home", "logs"], robots[:1])
            phase("", "ten healthy robots", ["home", "logs"], robots[:1])
            ill = container.db.write(
                lambda c: [
                    r.robots.add(
                        c,
                        Robot(
                            fate, at, "distributor", token, certificate_sha256=pin if at.startswith("https:") else None
                        ),
                    )
                    for fate, at in addresses.items()
                ]
            )
            stopped = threading.Event()

            def import_all() -> None:
                for file in cycle(files(base)):
                    if stopped.wait(1.0):
                        return
                    with suppress(Exception):
                        if file.suffix == ".ics":
                            container.calendar_files.read(str(file))
                        else:
                            configuration.import_configuration(container.catalogue, file.read_bytes())

            importing: Any = threading.Thread(target=import_all, daemon=True)
            importing.start()
            phase("attack ", f"and {len(ill)} hostile ones", ["home", "logs"], ill)
            stopped.set()
            time.sleep(2.0)
            alarms = [alarm.code for alarm in container.alarms.open()]
            app.dispatch("on_stop")
            container.close()
        attackers.kill()
        kept = True
        for name, due in planned.items():
            late = lateness(base / "posts.csv", due)
            p99 = late[int(0.99 * len(late))]
            kept &= len(late) == len(due) and (name != "attack " or p99 <= LATEST)
            print(
                f"{name or 'before ':<8} {len(late)} of {len(due)} missions, late p50 {late[len(late) // 2]:.1f} "
                f"p99 {p99:.1f} max {late[-1]:.1f} ms"
            )
        log = "".join(path.read_text(encoding="utf-8") for path in (base / "logs").iterdir())
        print(
            f"evidence in the log: {EVIDENCE in log} ({len(log) >> 10} KiB); in the alarm list: {'executions_missed' in alarms}; "
            f"most memory ever: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10} MiB"
        )
    sys.exit(0 if kept else 1)


if __name__ == "__main__":
    main()
