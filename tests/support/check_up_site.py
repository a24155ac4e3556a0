"""A simulated robot with the app that knows it, on a virtual clock: for check-ups, and what must be unchanged after them."""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path
from typing import Any, NoReturn

from app.container import Container
from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.domain.check_up import LeftBehind, Report, Trial
from app.domain.models import Robot
from app.mir.transport import Response
from app.services.check_up.service import CheckUps
from mir_sim import Profile
from tests.support.recorded_robot import ZONE, AskedRobot
from tests.support.site import Site

ENDED = ("Done", "Aborted")
DATABASE = "amr-scheduler.db"


class Killed(BaseException):
    """The process ends here: nothing catches it, and nothing that follows has an effect."""


def opened(directory: Path, asked: AskedRobot) -> Container:
    """The app, started on that directory."""
    db = Database.open(directory / DATABASE, clock=asked.clock, threaded=False, durable=False)
    container = Container(db, asked.clock, make_client=asked.client)
    container.first_start()
    return container


class Checked:
    """The app that knows what is asked, a robot or a fleet; it is the first in its ``database``."""

    asked: AskedRobot
    id = 1

    def __init__(self, directory: Path, database: bytes) -> None:
        self._directory = directory
        directory.mkdir(exist_ok=True)
        (directory / DATABASE).write_bytes(database)
        self.open()

    @property
    def machine(self) -> Any:
        return self.asked.machine

    def open(self) -> None:
        """The app is started (again)."""
        self.container = opened(self._directory, self.asked)

    def kill_at(self, number: int, *, is_handled: bool) -> None:
        """The app, at that request from now on, before or after it was handled, and at every later one."""
        count = 0

        def die_before(method: str, path: str) -> None:
            nonlocal count
            count += 1
            if count > number or (count == number and not is_handled):
                raise Killed

        def die_after(method: str, path: str, answer: Response) -> Response:
            if count == number:
                raise Killed
            return answer

        def release(*args: Any, **values: Any) -> NoReturn:
            raise Killed

        self.asked.before, self.asked.meddle = die_before, die_after
        self.container.holds.release = release  # type: ignore[method-assign]

    def start_again(self) -> None:
        self.asked.behave()
        self.container.db.close()
        self.open()


class CheckedRobot(Checked):
    def __init__(self, directory: Path, profile: Profile | None = None, *, history: int = 60, **values: Any) -> None:
        self.asked = AskedRobot(profile, history=history, **values)
        super().__init__(directory, _database(self.machine.serial_number))
        self.before = self.as_it_is()

    @property
    def check_ups(self) -> CheckUps:
        return self.container.check_ups

    def trial(self, mission: str | None = None, **values: Any) -> Report:
        """Queue missions on it; ``values`` as of ``CheckUps.run``."""
        return self.check_ups.run(self.id, Trial(mission), **values)

    def leave(self, **values: Any) -> None:
        """As if a trial had been cut off, which has queued missions."""
        left = LeftBehind(
            **{"serial_number": self.machine.serial_number, "tokens": ("a", "a", "b", "c"), "queue_floor": 400} | values
        )
        self.container.db.write(lambda c: CheckUpRepository().note_left_behind(c, self.id, left))

    def clean_up(self) -> None:
        """What a trial that was cut off has left on it is undone."""
        self.check_ups.put_back_all(list(self.check_ups.left_behind()))

    def check_nothing_is_left(self) -> None:
        """Here, of a trial that is to be undone."""
        assert (self.check_ups.left_behind(), self.container.holds.current()) == ([], [])

    def check_is_restored(self, when: object = "") -> None:
        """The robot is as it was before the trial."""
        assert self.as_it_is() == self.before, when
        self.check_nothing_is_left()

    def as_it_is(self) -> dict[str, Any]:
        """What a trial changes on the robot, and has to put back."""
        self.machine.catch_up()
        site = self.machine.site
        return {
            "missions": sorted(row["guid"] for row in site.table("/missions")),
            "is_paused": self.machine.paused,
            "actions": len(list(site.table("/missions/{mission_id}/actions"))),
            "state": self.machine.state.name,
            "open": [item.id for item in self.machine.queue if str(item.state) not in ENDED],
        }


@functools.cache
def _database(serial_number: str) -> bytes:
    """With that robot in it. Made once, as that takes as long as a check-up."""
    with tempfile.TemporaryDirectory() as directory:
        container = opened(Path(directory), AskedRobot(history=0))
        container.db.write(lambda c: container.repositories.settings.save(c, timezone=ZONE))
        robot = Robot("Aino", "http://10.0.0.1", "distributor", serial_number=serial_number)
        assert container.catalogue.save_robot(robot, password="distributor").id == 1
        container.db.close()
        return (Path(directory) / DATABASE).read_bytes()


class RunningClock:
    """The clock of a site: while a check-up waits, everything else continues."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self.now, self.monotonic = site.clock.now, site.clock.monotonic

    def sleep(self, seconds: float) -> None:
        self._site.run(seconds)


def check_ups_of(site: Site) -> CheckUps:
    """Check-ups of the app as it runs now."""
    c = site.container
    return CheckUps(
        c.db,
        clock=RunningClock(site),
        ledger=c.ledger,
        holds=c.holds,
        alarms=c.alarms,
        changes=c.changes,
        settings=c.settings,
        make_client=c.make_client,
    )
