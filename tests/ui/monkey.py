"""A random finger on the whole app: taps, drags, keys and turns of the window over all screens and dialogs, while robots get into trouble.

    uv run python -m tests.ui.monkey [--acts 20000] [--seed 1]

prints what the process has resident every ``WARM`` acts, with the same on screen each time, and ends with an error at the first
exception, the first error in the log, or when memory has grown by more than ``MOST_GROWTH_MIB`` since act ``WARM``. The robots, which keep
all they did, are in a process of their own. The same seed does the same, except for what robots answer.
"""

from __future__ import annotations

import argparse
import gc
import logging
import os
import random
import tempfile
from collections.abc import Callable
from contextlib import closing, suppress
from datetime import datetime
from pathlib import Path
from unittest import mock

from tests.support.fleet_process import serve_apart
from tests.ui import headless

headless.install()

from kivy.core.window import Window  # noqa: E402
from kivy.uix.behaviors import ButtonBehavior  # noqa: E402

import app.widgets  # noqa: E402
from app.domain.models import FONT_SCALES, THEMES, Schedule  # noqa: E402
from app.mir.errors import RobotError  # noqa: E402
from app.services.planning import public_holidays  # noqa: E402
from app.widgets.fields import FieldInput  # noqa: E402
from app.widgets.menu import Menu  # noqa: E402
from app.window.application import SchedulerApp  # noqa: E402
from app.window.garbage import give_back, share_one_heap  # noqa: E402
from app.window.window import quiet_garbage  # noqa: E402
from mir_sim.faults import AT_RANDOM  # noqa: E402
from tests.support.stored import Stored  # noqa: E402
from tests.ui.driver import Driver  # noqa: E402
from tests.ui.wear import SECTIONS, Wear  # noqa: E402
from tests.ui.whole_app import GUIDS, Plant, shown  # noqa: E402

ROBOTS = 5
SCHEDULES = 12
ROUNDS = 9  # a dialog each
WARM = 2_000  # acts, after which caches are full
MOST_GROWTH_MIB = 10.0
CHECK_UP_S = 600.0  # that a check-up which was begun may take, of a robot in trouble
SIZES = ((1280, 800), (800, 1280), (1024, 600), (1920, 1200), (600, 480))
KEYS = {
    "tab": 9,
    "enter": 13,
    "escape": 27,
    "space": 32,
    "backspace": 8,
    "up": 273,
    "down": 274,
    "right": 275,
    "left": 276,
}
WELL = {"fault": None, "error": None, "emergency_stop": False, "user_prompt": None}
PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


class Monkey:
    """What it does next is drawn from ``seed``. Every hundred acts the PIN of ``site`` is removed, and robots are there again if
    all were deleted."""

    def __init__(self, site: Plant, app: SchedulerApp, ui: Driver, seed: int) -> None:
        self._site, self._app, self._ui, self._rng = site, app, ui, random.Random(seed)
        self._acts: dict[Callable[[], object], int] = {
            self.tap_target: 60,
            self.tap_anywhere: 8,
            self.double_tap: 3,
            self.hold: 2,
            self.drag: 12,
            self.wheel: 3,
            self.key: 8,
            self.type: 3,
            self.turn: 1,
            self.trouble: 3,
        }
        self.done = 0
        self._stored = Stored(site.container)

    def act(self) -> str:
        """One act; returns its name."""
        (what,) = self._rng.choices(list(self._acts), list(self._acts.values()))
        what()
        self.done += 1
        if self.done % 100 == 0:
            self._keep_going()
        return what.__name__

    # ------------------------------------------------------------------ hands
    def tap_target(self) -> None:
        """Something that can be pressed, of what is topmost."""
        targets = self._targets()
        if targets:
            self._touch(self._place(self._rng.choice(targets)))

    def tap_anywhere(self) -> None:
        self._touch((self._rng.uniform(0, Window.width), self._rng.uniform(0, Window.height)))

    def double_tap(self) -> None:
        targets = self._targets()
        if targets:
            place = self._place(self._rng.choice(targets))
            self._touch(place, frames=1)
            self._touch(place)

    def hold(self) -> None:
        targets = self._targets()
        if targets:
            self._touch(self._place(self._rng.choice(targets)), frames=60)

    def drag(self) -> None:
        x, y = self._rng.uniform(0, Window.width), self._rng.uniform(0, Window.height)
        self._touch((x, y), (self._rng.uniform(-400, 400), self._rng.uniform(-600, 600)))

    def wheel(self) -> None:
        from kivy.tests.common import UnitTestTouch

        touch = UnitTestTouch(self._rng.uniform(0, Window.width), self._rng.uniform(0, Window.height))
        touch.profile, touch.button = ["pos", "button"], self._rng.choice(("scrollup", "scrolldown"))
        touch.touch_down()
        self._ui.advance()
        touch.touch_up()
        self._ui.advance()

    def key(self) -> None:
        code = self._rng.choice(list(KEYS.values()))
        self._ui.key_down(code, modifiers=("shift",) if self._rng.random() < 0.2 else ())
        Window.dispatch("on_key_up", code, 0)
        self._ui.advance()

    def type(self) -> None:
        for character in self._rng.choices("aä 12.:/-%[]☂", k=self._rng.randint(1, 6)):
            Window.dispatch("on_textinput", character)
        self._ui.advance()

    def turn(self) -> None:
        """Another size of the window."""
        Window.size = self._rng.choice(SIZES)
        self._ui.advance()

    def trouble(self) -> None:
        """Something happens to a robot, or all is well with it again."""
        robot = self._rng.choice(self._site.fleet.robots)
        robot.control(
            self._rng.choice(
                (
                    {"battery": self._rng.uniform(1, 100)},
                    {"emergency_stop": True},
                    {"error": {"code": 7, "description": "Cart not found"}},
                    {"user_prompt": {"question": "May I go on?", "options": ["Yes", "No", "Later"], "timeout": 60}},
                    {"reboot_seconds": 2},
                    {"fault": {"kind": self._rng.choice(AT_RANDOM), "count": 3, "seconds": 0.2}},
                    *[WELL] * 4,
                )
            )
        )

    # ------------------------------------------------------------------ around it
    def see_all(self) -> None:
        """Once every screen and dialog in every size and look, with a plan, its runs and alarms on them, the keyboard and the library of
        holidays: all that a finger finds or makes sooner or later."""
        wear = Wear(self._app, self._ui)
        for scale, theme, language in zip(FONT_SCALES, THEMES, ("en", "fi", "en"), strict=True):
            for size in SIZES:
                self._furnish()
                self._site.container.catalogue.change_settings(
                    keyboard="on", font_scale_percent=scale, theme=theme, language=language, gloves=language == "fi"
                )
                Window.size = size
                wear.rounds(ROUNDS)
                Window.size = size
                wear.see_sections(self._site.container.catalogue.robots()[0].id)
                self.rest()  # the old window and the new one, from the fullest
        self._app.shell.go("settings", section="robots", add=True)
        self._ui.wait(lambda: self._ui.find_all(FieldInput))
        self._ui.find(FieldInput).focus = True
        self._ui.advance(1)
        public_holidays.of_year("FI", "", 2026, "en")
        self.rest()

    def _furnish(self) -> None:
        container = self._site.container
        robots, missions = container.catalogue.robots(), container.catalogue.missions()
        for number in range(SCHEDULES):
            robot, mission = robots[number % len(robots)], missions[number % len(missions)]
            first = datetime(2026, 1, 1, number)
            container.catalogue.save_schedule(
                Schedule(f"Plan {number}", robot.id, mission.id, first, "UTC", "FREQ=DAILY")
            )
            container.operator.run_now(robot.id, mission.id)
        for robot in self._site.fleet.robots:
            robot.control({"error": {"code": 7, "description": "Cart not found"}})

    @property
    def where(self) -> str:
        """The screen, and what was opened on it."""
        opened = [type(top).__name__ for top in Window.children if top is not self._app.root]
        return " ".join([self._app.shell.navigator.current, *opened])

    def rest(self) -> None:
        """The same on screen each time, after any acts, so that memory can be compared: settings, plan and history as
        they were at first, all screens and sections built again, and nothing open or under way on Home."""
        Window.size = SIZES[0]
        for robot in self._site.fleet.robots:
            robot.control(WELL)
        self._app.shell.dialogs.close_all()
        self._ui.wait(lambda: self._app.shell.background.idle, CHECK_UP_S)
        for execution in self._site.container.history.open():
            with suppress(RobotError):
                self._site.container.operator.cancel_execution(execution.id)
        self._stored.put_back()
        self._app.shell.go(
            "home", robot_id=self._site.container.catalogue.robots()[0].id
        )  # not all of them, a third of its widgets
        self._ui.wait(lambda: self._app.shell.background.idle, CHECK_UP_S)
        self._app.shell.navigator.rebuild()
        self._collect()  # before everything is built a second time
        for name, intent in (
            *(("settings", {"section": section}) for section in SECTIONS),
            ("scheduler", {}),
            ("logs", {}),
            ("home", {}),
        ):
            self._app.shell.go(name, **intent)
            self._ui.wait(lambda: self._app.shell.background.idle, CHECK_UP_S)
        self._collect()

    def _collect(self) -> None:
        self._ui.skip(200)  # kivy's caches forget
        self._ui.advance(1)
        for _n in range(3):
            gc.unfreeze()
            gc.collect()
            self._ui.advance()
        gc.freeze()  # as before
        give_back()

    def _keep_going(self) -> None:
        catalogue = self._site.container.catalogue
        self._site.container.access.remove()
        if not catalogue.robots():
            self._site.add_robots()
        if not catalogue.missions():
            self._site.add_missions(*list(GUIDS)[:6])

    def _targets(self) -> list:
        tops = [top for top in Window.children if getattr(top, "is_open", True)]
        last = next((n for n, top in enumerate(tops) if isinstance(top, Menu)), len(tops) - 1)
        return [
            widget
            for top in tops[: last + 1]
            for widget in self._ui.seen(top)
            if isinstance(widget, ButtonBehavior) and not widget.disabled and widget.width > 1 and widget.height > 1
        ]

    @staticmethod
    def _place(target) -> tuple[float, float]:
        return target.to_window(*target.center)

    def _touch(self, place: tuple[float, float], by: tuple[float, float] = (0, 0), frames: int = 4) -> None:
        from kivy.tests.common import UnitTestTouch

        touch = UnitTestTouch(*place)
        touch.touch_down()
        for n in range(1, frames + 1):
            self._ui.advance()
            if any(by):
                touch.touch_move(place[0] + by[0] * n / frames, place[1] + by[1] * n / frames)
        touch.touch_up()
        self._ui.advance(self._rng.choice((0, 0.1, 0.5)))


class Errors(logging.Handler):
    """What the log says that it never should."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.said: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(f"{record.name}: {self.format(record)}")


def play(
    directory: Path, ui: Driver, acts: int, seed: int, tell: Callable[[str], object] = lambda _line: None
) -> tuple[list[str], float]:
    """``acts`` acts on a fresh tablet; returns the errors in the log and the growth of resident memory since act ``WARM`` in MiB."""
    share_one_heap()  # as the app does
    errors = Errors()
    logging.getLogger().addHandler(errors)
    before, first, last = Path.cwd(), 0.0, 0.0
    os.chdir(directory)  # for what is exported to a name without a directory
    home = mock.patch.dict(os.environ, HOME=str(directory))  # and with the one that is proposed
    home.start()
    try:
        with serve_apart(ROBOTS, time_scale=20) as fleet, closing(Plant(directory / "data", fleet)) as site:
            site.container.runner.start()
            site.add_robots()
            site.add_missions(*list(GUIDS)[:6])
            with shown(site.container, ui) as app, quiet_garbage(app):
                monkey = Monkey(site, app, ui, seed)
                if acts > WARM:
                    monkey.see_all()
                while monkey.done < acts and not errors.said:
                    try:
                        name = monkey.act()
                    except Exception:
                        tell(f"act {monkey.done} with seed {seed} raised")
                        raise
                    if errors.said:
                        tell(f"act {monkey.done} with seed {seed}, {name}, at {Window.size} on {monkey.where}")
                    if monkey.done % WARM == 0 or monkey.done == acts:
                        in_use = resident()
                        monkey.rest()
                        last = resident()
                        first = first or last
                        tell(
                            f"{monkey.done:>6} acts, the last was {name}; resident {in_use:.1f} MiB in use, {last:.1f} at rest"
                        )
                return errors.said, last - first
    finally:
        home.stop()
        os.chdir(before)
        logging.getLogger().removeHandler(errors)


def resident() -> float:
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * PAGE_MIB


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.ui.monkey")
    options.add_argument("--acts", type=int, default=20_000)
    options.add_argument("--seed", type=int, default=1)
    args = options.parse_args()
    app.widgets.load()
    with tempfile.TemporaryDirectory() as directory:
        said, growth = play(Path(directory), Driver(), args.acts, args.seed, lambda line: print(line, flush=True))
    print("\n".join(said) or f"no error; {growth:+.1f} MiB since act {WARM}")
    if said or growth > MOST_GROWTH_MIB:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
