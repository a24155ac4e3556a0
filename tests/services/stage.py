"""Stories: what people and the world do to a site, step by step, and what has to be true then.

A step is a value that acts on a ``Stage``; a number is seconds that pass, a list is its steps, ``each`` is one of several. One case of a
story is in the default run, which takes any of the values, if it lasts 20 minutes at most or is the shortest of its table; all others are
``long``. In the end no row is open and no start is on robots twice, unless the story says otherwise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import wraps
from itertools import product
from pathlib import Path
from zlib import crc32

import pytest
from hypothesis import settings

from app.domain.execution import Execution
from app.domain.models import Mission, Robot, Schedule
from app.services.dispatch import timing, worker
from mir_sim.mission_queue import QueueItem
from tests.support.groups import Hall
from tests.support.seen import sent_at

DAY = 86400.0
LASTS_BY_DAY = 1200.0  # s of a story's time
RARELY = 5.0  # s between reads of a robot with something of ours, instead of 2
BEGIN = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)


def instant(text: str) -> datetime:
    """ "06:05" of the first day, or "24T06:05"."""
    return datetime.fromisoformat(f"2026-11-{text if 'T' in text else f'23T{text}'}")


class Stage(Hall):
    """The site of a story: robots of one group, the mission Deliver, and schedules of R1 or of the group."""

    def __init__(self, directory: Path, on: str, robots: int, **values) -> None:
        super().__init__(directory, robots=robots, **values)
        self.container.catalogue.change_settings(poll_interval_seconds=90)  # polls are most of a story's time
        self.where = {"robot_id": 1, "group_id": None} if on == "robot" else {"robot_id": None, "group_id": 1}
        self.removed: list = []
        self.noted: list = []  # what steps pass on to later ones: rows, instants
        self.others: list[Stage] = []  # tablets with a copy of the data

    def schedule(self, name: str = "A") -> Schedule:
        found = self.container.catalogue.schedules()
        return next((each for each in found if each.name == name), found[0])

    def mission(self, name: str = "Deliver") -> Mission:
        return next(each for each in self.container.catalogue.missions() if each.name == name)

    def row(self, name: str = "") -> Execution:
        """The newest start, of a schedule or of any."""
        return next(row for row in reversed(self.executions()) if not name or row.schedule == name)

    def its_robot(self) -> Robot:
        """Of the start that was made first, or R1."""
        number = next((row.robot_id for row in self.executions() if row.robot_id), 1)
        return next(robot for robot in self.container.catalogue.robots() if robot.id == number)

    def all_items(self) -> list[QueueItem]:
        return self.items()

    def doubled(self) -> list[str]:
        """Tokens with several items, none of them withdrawn."""
        ours = {row.token for row in self.executions()} | {post.token for post in self.network.posts()}
        found = Counter(item.description for item in self.all_items() if str(item.state) != "Aborted")
        return [token for token, number in found.items() if number > 1 and token in ours]

    def said(self) -> str:
        rows = [(row.schedule, str(row.state), row.wait, row.reason and row.reason.code) for row in self.executions()]
        return f"{self.clock.now():%d %H:%M:%S}, rows {rows}, sent {sent_at(self)}, alarms {self.alarms()}"


@dataclass(frozen=True)
class Step:
    name: str
    act: Callable[[Stage], object]

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class Each:
    values: tuple


def each(*values) -> Each:
    return Each(values)


def step(act: Callable) -> Callable[..., Step]:
    """What is called with a stage and values becomes what makes steps of values."""

    @wraps(act)
    def make(*values, **named) -> Step:
        shown = [value for value in values if not callable(value)]
        said = ", ".join([*map(str, shown), *(f"{name}={value}" for name, value in named.items())])
        return Step(f"{act.__name__}({said})" if len(said) < 50 else act.__name__, lambda s: act(s, *values, **named))

    return make


def play(s: Stage, *steps) -> None:
    for one in steps:
        if isinstance(one, Step):
            try:
                one.act(s)
            except Exception as error:
                error.add_note(f"{one} at {s.said()}")
                raise
        elif isinstance(one, list | tuple):
            play(s, *one)
        else:
            s.run(one)


class Story:
    """``on``: R1, or its group, or each. ``mark``: which targets it can be about. ``robots``, ``with_window`` and
    others are of the ``Stage``."""

    def __init__(self, name: str, *steps, on="robot", robots=1, stays_open=False, doubles=False, mark=None, **site):
        self.name, self.steps, self.site = name, steps, {"robots": robots, **site}
        self.on = each(*([on] if isinstance(on, str) else on))
        self.stays_open, self.doubles, self.marks = stays_open, doubles, (mark,) if mark else ()

    @property
    def axes(self) -> list[tuple]:
        return [one.values for one in (self.on, *self.steps) if isinstance(one, Each)]

    @property
    def quick(self) -> tuple[int, ...]:
        """The case that may be in the default run."""
        number = crc32(self.name.encode())  # the same in every process
        return tuple(number % len(axis) for axis in self.axes)

    def steps_of(self, chosen: tuple[int, ...]) -> list:
        picks = iter(chosen[1:])
        return [one.values[next(picks)] if isinstance(one, Each) else one for one in self.steps]

    def lasts(self) -> float:
        return seconds(self.steps_of(self.quick))

    def cases(self, by_day: bool) -> Iterator:
        axes, quick = self.axes, self.quick
        for chosen in product(*map(range, map(len, axes))):
            values = [axis[index] for axis, index in zip(axes, chosen, strict=True) if len(axis) > 1]
            labels = [self.name, *(said(value) for value in values)]
            marks = self.marks if by_day and chosen == quick else (*self.marks, pytest.mark.long)
            yield pytest.param(self, chosen, id=", ".join(labels), marks=marks)

    def play(self, directory: Path, chosen: tuple[int, ...]) -> None:
        s = Stage(directory, self.on.values[chosen[0]], **self.site)
        with pytest.MonkeyPatch.context() as patch:
            if settings.default.max_examples <= 12:  # with the app's own pause, as in other profiles, a third more time
                patch.setattr(worker, "LIVE_EVERY", RARELY)
            try:
                play(s, *self.steps_of(chosen))
                still = [] if self.stays_open else [row.state for row in s.executions() if row.state.is_open]
                assert still == [], f"still open: {s.said()}"
                assert self.doubles or s.doubled() == [], f"twice: {s.said()}"
            finally:
                for tablet in (*s.others, s):
                    tablet.switch_off()


# A step for stories about what happens between two reads of a robot: it is read as often as by the app.
READ_OFTEN = Step("read often", lambda s: setattr(worker, "LIVE_EVERY", timing.LIVE_EVERY))


def seconds(value) -> float:
    """That pass in steps."""
    if isinstance(value, list | tuple):
        return sum(map(seconds, value))
    return value if isinstance(value, int | float) else 0.0


def said(value) -> str:
    """Of a case's name."""
    return " ".join(map(said, value)) if isinstance(value, list | tuple) else str(value)


def cases_of(*stories: Story):
    """Makes a test of each case of them."""

    longest = max(LASTS_BY_DAY, min(story.lasts() for story in stories))

    @pytest.mark.parametrize(
        ("story", "chosen"), [case for story in stories for case in story.cases(story.lasts() <= longest)]
    )
    def test(story: Story, chosen: tuple[int, ...], tmp_path: Path) -> None:
        story.play(tmp_path, chosen)

    return test
