"""How a person starts the app again: by the name that it was started by, quoted for the shell at hand."""

from __future__ import annotations

import getpass
import os
import re
import shlex
import shutil
import sys
from contextlib import suppress
from pathlib import Path

INSTALLED = "amr-scheduler"
OWN_USER = "amr-scheduler"  # that the .deb makes for itself


def is_installed() -> bool:
    """Whether the installed command was started, and not the checkout's main.py."""
    return Path(sys.argv[0]).stem == INSTALLED


def program() -> str:
    """What stands before an error, and in --help."""
    return INSTALLED if is_installed() else "main.py"


def command(*arguments: object) -> str:
    """A whole command to copy. An installed one that the shell does not find is named by its Python. The user of the .deb has no shell."""
    if not is_installed():
        start = ["python", "main.py"]
    elif shutil.which(INSTALLED):
        start = ["sudo", "-u", OWN_USER, INSTALLED] if _user() == OWN_USER else [INSTALLED]
    else:  # on Windows the shortcut's pythonw prints nothing
        start = [re.sub(r"pythonw(?=\.exe$)", "python", sys.executable), "-m", "amr_scheduler"]
    return " ".join(quote(str(word)) for word in [*start, *arguments])


def _user() -> str:
    with suppress(KeyError, OSError, ImportError):  # a container may have no name for it
        return getpass.getuser()
    return ""


def quote(word: str) -> str:
    """One word of a command for sh, on Windows for cmd and PowerShell."""
    if os.name != "nt":
        return shlex.quote(word)
    return word if re.fullmatch(r"[\w.:\\/-]+", word) else f'"{word}"'
