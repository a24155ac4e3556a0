"""Who may read a file."""

from __future__ import annotations

import os
import stat
from pathlib import Path


def is_private(*paths: Path) -> bool:
    """Only their owner can use them. Windows has no modes: a user's directory is private there as a whole."""
    return os.name != "posix" or all(stat.S_IMODE(path.stat().st_mode) in (0o600, 0o700) for path in paths)
