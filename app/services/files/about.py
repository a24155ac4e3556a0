"""What this installation consists of: versions and licences."""

from __future__ import annotations

import platform
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata

# what is shipped, by the name of its distribution; the licences as their authors declare them (SPDX)
LICENCES = (
    ("Kivy", "MIT"),
    ("KivyMD", "MIT"),
    ("asynckivy", "MIT"),
    ("asyncgui", "MIT"),
    ("materialyoucolor", "MIT"),
    ("materialshapes", "MIT"),
    ("filetype", "MIT"),
    ("Pillow", "MIT-CMU"),
    ("docutils", "BSD-2-Clause"),
    ("Pygments", "BSD-2-Clause"),
    ("Kivy-Garden", "MIT"),
    ("requests", "Apache-2.0"),
    ("urllib3", "MIT"),
    ("certifi", "MPL-2.0"),
    ("idna", "BSD-3-Clause"),
    ("charset-normalizer", "MIT"),
    ("platformdirs", "MIT"),
    ("holidays", "MIT"),
    ("icalendar", "BSD-2-Clause"),
    ("python-dateutil", "Apache-2.0 OR BSD-3-Clause"),
    ("six", "MIT"),
    ("tzdata", "Apache-2.0"),
    ("typing_extensions", "PSF-2.0"),
)
BUNDLED = (("Roboto", "Apache-2.0"), ("Material Design Icons", "Apache-2.0"))  # fonts inside KivyMD


@dataclass(frozen=True)
class Component:
    """Something this app is built on. An empty ``version`` is not known."""

    name: str
    version: str
    licence: str


def components() -> Sequence[Component]:
    """Python and SQLite first, then everything that is installed, then the fonts."""
    return [
        Component("Python", platform.python_version(), "PSF-2.0"),
        Component("SQLite", sqlite3.sqlite_version, "public domain"),
        *(Component(name, version, licence) for name, licence in LICENCES if (version := _version(name))),
        *(Component(name, "", licence) for name, licence in BUNDLED),
    ]


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""
