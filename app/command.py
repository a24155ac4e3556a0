"""How a person starts the app again: by the name that it was started by, quoted for the shell at hand."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from pathlib import Path

INSTALLED = "amr-scheduler"


def is_installed() -> bool:
    """Whether the installed command was started, and not the checkout's main.py."""
    return Path(sys.argv[0]).stem == INSTALLED


def program() -> str:
    """What stands before an error, and in --help."""
    return INSTALLED if is_installed() else "main.py"


def command(*arguments: object) -> str:
    """A whole command to copy. An installed one that the shell does not find is named by its Python."""
    if not is_installed():
        start = ["python", "main.py"]
    elif shutil.which(INSTALLED):
        start = [INSTALLED]
    else:  # on Windows the shortcut's pythonw prints nothing
        start = [re.sub(r"pythonw(?=\.exe$)", "python", sys.executable), "-m", "amr_scheduler"]
    return " ".join(quote(str(word)) for word in [*start, *arguments])


def quote(word: str) -> str:
    """One word of a command for sh, on Windows for cmd and PowerShell."""
    if os.name != "nt":
        return shlex.quote(word)
    return word if re.fullmatch(r"[\w.:\\/-]+", word) else f'"{word}"'
