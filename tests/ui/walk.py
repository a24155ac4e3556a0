"""A walk over every widget of every registered screen and dialog, without drawing: what the eye might miss in some size, language or theme.

    uv run python -m tests.ui.walk [picture …]

walks the full product by hand (sizes × languages × themes × sizes of text, with and without an alarm), about two minutes a picture, and
prints what ``checks.problems`` finds; ``--part 1/2`` and ``--part 2/2`` share the pictures between two cores. CI walks the covering
subset of ``test_every_screen``.
Each picture of tests/screenshots is built once per language and size of texts and then resized and recoloured live.
"""

from __future__ import annotations

import argparse
import gc
import itertools
import logging
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from tests.ui import headless

headless.install()

from kivy.core.window import Window  # noqa: E402
from kivy.logger import Logger  # noqa: E402
from kivy.metrics import Metrics  # noqa: E402
from kivy.uix.label import Label  # noqa: E402

from app.i18n import _, languages, translator  # noqa: E402
from app.screens.frame.view import BannerView  # noqa: E402
from app.widgets.frame import Frame  # noqa: E402
from tests.screenshots.registry import LANDSCAPE, PICTURES, THEMES, Picture, find_pictures  # noqa: E402
from tests.screenshots.studio import Studio  # noqa: E402
from tests.ui import checks  # noqa: E402

SIZES = ((1280, 800), (1920, 1200), (800, 1280), (1024, 600), (600, 800))
NARROW = SIZES[-1]
FONT_SCALES = (1.0, 1.3)
SCREENS = ("home", "scheduler", "logs", "settings-robots")
ALARM, ALARM_NOTE = "Aino: Failed to reach goal position 'Line 2'", "14:37"
SAME_LETTERS = {"Yes", "No", "To", "Summer break"}  # a robot's own answers, Thursday in Finnish, a name in a file


@dataclass(frozen=True)
class Way:
    """How a picture is looked at."""

    language: str
    size: tuple[int, int]
    theme: str
    font_scale: float
    alarm: bool = False  # a banner above the screen

    def __str__(self) -> str:
        return f"{self.size[0]}×{self.size[1]} {self.language} {self.theme} ×{self.font_scale:g}{' alarm' if self.alarm else ''}"


def every_way() -> list[Way]:
    """The full product."""
    return [Way(*way) for way in itertools.product(languages(), SIZES, THEMES, FONT_SCALES, (False, True))]


def covering_ways(number: int, name: str) -> list[Way]:
    """Of the picture with this number: a screen in all sizes, and in a narrow window with large texts below an alarm; all else in one size.
    Languages, themes, texts and alarms in turn. Over all pictures each size meets each language, each theme and both sizes of text."""
    known = languages()
    numbers = range(number, number + len(SIZES)) if name in SCREENS else (number,)
    ways = [
        Way(
            known[n // 4 % len(known)],
            SIZES[n % len(SIZES)],
            THEMES[n % len(THEMES)],
            FONT_SCALES[n // 8 % 2],
            bool(n // 16 % 2),
        )
        for n in numbers
    ]
    return ways + [Way(language, NARROW, "light", FONT_SCALES[-1], True) for language in known if name in SCREENS]


class Walk:
    """In the window of the tests, which every look leaves unchanged."""

    def __init__(self) -> None:
        self._size = Window.size
        self._unsettled = _Unsettled()
        Logger.addHandler(self._unsettled)
        self._studio = Studio(LANDSCAPE)
        broken = find_pictures()
        if broken:
            raise ExceptionGroup("pictures that can't be imported", broken)
        gc.collect()
        gc.freeze()  # looking through all that stays would be more than half the time

    @property
    def pictures(self) -> list[Picture]:
        return list(PICTURES.values())

    def look(self, picture: Picture, ways: Iterable[Way]) -> Iterator[tuple[Way, str]]:
        """``over``, for which a picture that can't be built is a finding too."""
        ways = list(ways)
        try:
            yield from self.over(picture, ways)
        except Exception as problem:
            yield ways[0], f"can't be built: {type(problem).__name__}: {problem}"
        finally:
            gc.collect()  # widgets of the picture would be recoloured and laid out again
            self._look(Way("en", self._size, "light", 1.0))

    def over(self, picture: Picture, ways: Iterable[Way]) -> Iterator[tuple[Way, str]]:
        """What is wrong with ``picture``, way by way."""

        def look(way: Way) -> tuple[str, float]:  # at another size of text the app rebuilds its screens, too
            return way.language, way.font_scale

        for _look, group in itertools.groupby(sorted(ways, key=look), key=look):
            yield from self._built(picture, list(group))

    def _built(self, picture: Picture, ways: list[Way]) -> Iterator[tuple[Way, str]]:
        self._look(ways[0])
        try:
            widget = picture.build(self._studio)
            for way in ways:
                self._look(way)
                self._studio.driver.advance(0.2)
                root = widget if widget is not None else self._studio.shown
                for problem in (*self._restless(), *checks.problems(root)):
                    yield way, problem
                for problem in untranslated(root, way.language):
                    yield way, problem
        finally:
            self._studio.clear()

    @contextmanager
    def built(self, picture: Picture) -> Iterator[None]:
        """The picture, in the window of the tests, to be used."""
        try:
            picture.build(self._studio)
            yield
        finally:
            self._studio.clear()
            gc.collect()

    def _restless(self) -> Iterator[str]:
        """Layouts that move each other for ever keep the processor busy, and once they grow, nothing stays in its place."""
        self._unsettled.times = 0
        self._studio.driver.advance()
        if self._unsettled.times:
            yield "never settles"

    def _look(self, way: Way) -> None:
        if translator.language != way.language:
            translator.use(way.language)
        if tuple(Window.size) != tuple(way.size):
            Window.size = way.size
        if Metrics.fontscale != way.font_scale:
            Metrics.fontscale = way.font_scale
        if self._studio.theme != way.theme:
            self._studio.use(way.theme)
        self._show_alarm(way.alarm)

    def _show_alarm(self, is_shown: bool) -> None:
        """A banner in the picture's frame, if it has none."""
        frame = self._studio.shown
        if isinstance(frame, Frame) and (not (frame.banner and frame.banner.text) or frame.banner.text == ALARM):
            frame.banner = BannerView(ALARM, action=_("Release")) if is_shown else BannerView()

    def close(self) -> None:
        Logger.removeHandler(self._unsettled)


class _Unsettled(logging.Handler):
    """Counts the frames in which kivy gave up before everything was laid out."""

    times = 0

    def emit(self, record: logging.LogRecord) -> None:
        self.times += "too much iteration" in record.getMessage()


def untranslated(root, language: str) -> Iterator[str]:
    """Texts in English although the catalogue has other words for them: they were not asked for in the language of the moment."""
    if language == "en":
        return
    for widget, _above in checks.shown(root):
        if (
            isinstance(widget, Label)
            and widget.text not in SAME_LETTERS
            and translator.gettext(widget.text) != widget.text
        ):
            yield f"not in {language}: {checks.name_of(widget)}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.ui.walk", description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="pictures (default: all)")
    parser.add_argument("--covering", action="store_true", help="only the ways that CI walks")
    parser.add_argument("--part", type=part, default=(1, 1), metavar="K/N", help="every N-th picture from the K-th on")
    options = parser.parse_args()
    gc.disable()  # each picture's garbage is fetched when it has been seen
    walk, found = Walk(), 0
    first, step = options.part
    wanted = [
        (number, picture)
        for number, picture in enumerate(walk.pictures)
        if not options.names or picture.name in options.names
    ]
    for number, picture in wanted[first - 1 :: step]:
        for way, problem in walk.look(
            picture, covering_ways(number, picture.name) if options.covering else every_way()
        ):
            found += 1
            print(f"{picture.name} {way}: {problem}", flush=True)
        print(f"{picture.name} seen", file=sys.stderr, flush=True)
    print(f"{found} findings")
    return bool(found)


def part(text: str) -> tuple[int, int]:
    """(K, N) of "K/N"."""
    first, step = map(int, text.split("/"))
    if not 1 <= first <= step:
        raise ValueError(text)
    return first, step


if __name__ == "__main__":
    sys.exit(main())
