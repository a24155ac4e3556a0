"""What only Windows can be asked: its registry and its drives. Other systems have neither."""

from __future__ import annotations

import ctypes
import string
import sys
from collections.abc import Iterator
from typing import NamedTuple

REMOVABLE, REMOTE = 2, 4  # of GetDriveTypeW
_FAIL_QUIETLY = 1  # SEM_FAILCRITICALERRORS: no dialog that asks for a medium


class Drive(NamedTuple):
    """``root`` is as E:\\, ``kind`` as from GetDriveTypeW, ``label`` the name of its volume; None without a medium."""

    root: str
    kind: int
    label: str | None


def registry_value(root: str, path: str, name: str) -> str:
    """``root`` as HKEY_LOCAL_MACHINE; "" if there is no such value."""
    if sys.platform != "win32":
        return ""
    import winreg

    try:
        with winreg.OpenKey(getattr(winreg, root), path) as key:
            value = str(winreg.QueryValueEx(key, name)[0])
    except OSError:
        return ""
    return value.partition("\0")[0].strip()  # some systems leave garbage behind it


def drives() -> Iterator[Drive]:
    """By letter. A drive of the network has the label "": a server that is off would not answer."""
    if sys.platform != "win32":
        return
    kernel, before = ctypes.windll.kernel32, ctypes.c_ulong()
    kernel.SetThreadErrorMode(_FAIL_QUIETLY, ctypes.byref(before))
    present = kernel.GetLogicalDrives()
    for number, letter in enumerate(string.ascii_uppercase):
        if present >> number & 1:
            root, label = f"{letter}:\\", ctypes.create_unicode_buffer(261)
            kind = kernel.GetDriveTypeW(root)
            is_there = kind == REMOTE or kernel.GetVolumeInformationW(root, label, 261, None, None, None, None, 0)
            yield Drive(root, kind, label.value if is_there else None)
    kernel.SetThreadErrorMode(before.value, None)
