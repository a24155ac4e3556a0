"""Links in directories in which others may write, such as /tmp: whoever put one there would decide which file an export replaces."""
from __future__ import annotations

import os
import stat
from pathlib import Path

from app.domain.models import InvalidInput

MOST_LINKS = 40              # that lead from one to the other, as the system has it


def refuse_planted(path: Path) -> None:
    """Raises InvalidInput("path", …) when the way to this file leads through such a link, or ends at a pipe in such a directory."""
    here = path.absolute()
    for _ in range(MOST_LINKS):
        for place in (here, *here.parents):
            if _could_be_planted(place):
                raise InvalidInput("path", "{path} is a link or a pipe in a directory in which others may write: choose another place",
                                   path=place)
        if not here.is_symlink():
            return
        here = here.parent / os.readlink(here)
    raise InvalidInput("path", "{path} is a link that leads nowhere", path=path)


def _could_be_planted(place: Path) -> bool:
    try:
        found, mode = place.lstat(), place.parent.stat().st_mode
    except OSError:
        return False
    if os.name != "posix" or not (stat.S_ISLNK(found.st_mode) or stat.S_ISFIFO(found.st_mode)):
        return False
    return bool(mode & stat.S_IWOTH) or (bool(mode & stat.S_IWGRP) and found.st_uid != os.geteuid())
