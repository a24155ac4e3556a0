"""Which pictures there are."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tests.screenshots.studio import Studio

THEMES = ("light", "dark", "contrast")


@dataclass(frozen=True)
class Size:
    """A window: width and height in px, px per dp, and the factor on texts that the operator may set."""

    name: str
    width: int
    height: int
    density: float = 1.0
    font_scale: float = 1.0
    gloves: bool = False


LANDSCAPE = Size("landscape", 1280, 800)
PORTRAIT = Size("portrait", 800, 1280)
SMALL = Size("small", 1024, 600)
SHARP = Size("sharp", 1920, 1200, density=1.5)
LARGE_TEXT = Size("large-text", 1280, 800, font_scale=1.3)
SMALL_LARGE_TEXT = Size("small-large-text", 1024, 600, font_scale=1.3)
GLOVES = Size("gloves", 1280, 800, gloves=True)
SIZES = {size.name: size for size in (LANDSCAPE, PORTRAIT, SMALL, SHARP, LARGE_TEXT, SMALL_LARGE_TEXT, GLOVES)}
BOTH = (LANDSCAPE, PORTRAIT)

Builder = Callable[["Studio"], Any]


@dataclass(frozen=True)
class Picture:
    name: str
    build: Builder
    sizes: Sequence[Size]
    themes: Sequence[str]


PICTURES: dict[str, Picture] = {}

# What docs/screens shows: by size, theme and language.
DOCUMENTED: Sequence[tuple[str, str, str, Sequence[str]]] = (
    (
        "landscape",
        "light",
        "en",
        (
            "fleet-fifty",
            "fleet-fifty-well",
            "fleet-filter",
            "home",
            "home-map",
            "home-question",
            "home-error",
            "home-estop",
            "home-unreachable",
            "home-held",
            "home-parameters",
            "home-waiting",
            "alarms",
            "late-starts",
            "damaged-database",
            "scheduler",
            "scheduler-bar-planned",
            "scheduler-held",
            "scheduler-fifty",
            "scheduler-dragged",
            "scheduler-monthly",
            "scheduler-once-refused",
            "scheduler-group",
            "scheduler-suggestions",
            "logs",
            "logs-figures",
            "logs-figures-below",
            "logs-activity",
            "robot-sheet",
            "robot-dialog-certificate",
            "robot-dialog-new-robot",
            "check-up-robots",
            "check-up-trial",
            "check-up-running",
            "check-up-report",
            "settings-missions",
            "settings-idle",
            "settings-calendar-days",
            "settings-display",
            "settings-data",
            "settings-groups",
        ),
    ),
    ("landscape", "light", "fi", ("fleet-fifty", "home", "scheduler", "logs-figures")),
    ("landscape", "dark", "en", ("fleet-fifty", "home", "scheduler", "logs")),
    ("landscape", "contrast", "en", ("fleet-fifty", "home", "scheduler", "logs")),
    ("portrait", "light", "en", ("fleet-fifty", "home", "scheduler", "logs")),
    ("small", "light", "en", ("home", "home-estop")),
    ("sharp", "light", "en", ("fleet-fifty", "home")),
    ("large-text", "light", "fi", ("home",)),
    ("gloves", "light", "en", ("home",)),
)


def documented() -> set[str]:
    """The names of their files."""
    return {file_name(name, size, theme, language) for size, theme, language, names in DOCUMENTED for name in names}


def file_name(name: str, size: str, theme: str, language: str = "en") -> str:
    return "-".join((name, size, *(() if language == "en" else (language,)), theme)) + ".png"


def picture(name: str, sizes: Sequence[Size] = BOTH, themes: Sequence[str] = THEMES) -> Callable[[Builder], Builder]:
    """Register ``build(studio)`` as the picture ``name``."""

    def register(build: Builder) -> Builder:
        if name in PICTURES:
            raise ValueError(f"two pictures are called {name}")
        PICTURES[name] = Picture(name, build, sizes, themes)
        return build

    return register


def find_pictures() -> list[Exception]:
    """Fill ``PICTURES`` from all modules of this package, in the process that has the window, as they import widgets.

    Returns what kept a module from being imported: it must not hide the pictures of the others.
    """
    import tests.screenshots as package

    problems = []
    for module in pkgutil.iter_modules(package.__path__):
        if module.name not in ("__main__", "registry", "studio"):
            try:
                importlib.import_module(f"{package.__name__}.{module.name}")
            except Exception as problem:
                problems.append(problem)
    return problems
