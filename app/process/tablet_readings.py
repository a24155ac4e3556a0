"""What the system says of the tablet itself: room on its disk, its clock, battery and network. None where the system doesn't say, or says
nonsense."""

from __future__ import annotations

import ctypes
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Generic, TypeVar

from app.services.live.tablet_troubles import Battery, Readings, Room

LARGEST_ERROR = 16_000_000  # µs; the kernel adds 0.5 ms each second, and from here on its clock is on its own
MAXERROR = 3  # place of that error in struct timex, counted in longs
MAY_ASK_KERNEL = "AMR_SCHEDULER_MAY_ASK_KERNEL"  # set by the units of the .deb
SYNCHRONISED = Path("run/systemd/timesync/synchronized")  # touched by timesyncd each time that a server answers
TOO_LONG_AGO = 32_000.0  # s, after which the kernel's error is that large
ROUTE_IS_UP = 1  # in the flags of a route
TO_NO_ROBOT = ("fe8", "ff")  # IPv6: each interface has these routes to its own cable
PATIENCE = 0.1  # s for an answer; usual is less than 1 ms

T = TypeVar("T")


def readings(database: Path) -> Readings:
    """Of this tablet, whose database this is."""
    return Readings(
        LastAnswer(lambda: room(database)),
        LastAnswer(is_clock_synchronised),
        LastAnswer(battery),
        LastAnswer(has_network),
    )


class LastAnswer(Generic[T]):
    """Asks on a thread of its own: a driver or a dead mount may never answer, and the scheduler must not wait for it."""

    def __init__(self, ask: Callable[[], T | None]) -> None:
        self._ask = ask
        self._answer: T | None = None
        self._asking: threading.Thread | None = None

    def __call__(self) -> T | None:
        """None if there was no answer yet."""
        if self._asking is None or not self._asking.is_alive():
            self._asking = threading.Thread(target=self._take, name="tablet", daemon=True)
            self._asking.start()
            self._asking.join(PATIENCE)
        return self._answer

    def _take(self) -> None:
        self._answer = self._ask()


def room(database: Path) -> Room | None:
    with suppress(OSError):
        return Room(shutil.disk_usage(database.parent).free, database.stat().st_size)
    return None


# ---------------------------------------------------------------------- the clock
def is_clock_synchronised(root: Path = Path("/")) -> bool | None:
    """Whether a time server sets it, judged as timedatectl does: by the kernel's largest error. A service of systemd
    may be ended for asking the kernel: unless its unit says that it may, timesyncd's file counts there."""
    if sys.platform != "linux":
        return None
    if "Seccomp:\t0" in _text(root / "proc/self/status") or os.environ.get(MAY_ASK_KERNEL):
        error = _largest_error()
        return None if error is None else error < LARGEST_ERROR
    with suppress(OSError):
        return time.time() - (root / SYNCHRONISED).stat().st_mtime < TOO_LONG_AGO
    return False if (root / SYNCHRONISED).parent.is_dir() else None


def _largest_error() -> int | None:
    """In µs; only asks (adjtimex(2), modes 0)."""
    timex = (ctypes.c_long * 64)()
    with suppress(OSError, AttributeError):
        return None if ctypes.CDLL(None).adjtimex(timex) == -1 else int(timex[MAXERROR])
    return None


# ---------------------------------------------------------------------- the battery
if sys.platform == "win32":

    class _PowerStatus(ctypes.Structure):  # SYSTEM_POWER_STATUS
        _fields_ = (
            *((name, ctypes.c_ubyte) for name in ("ac", "flags", "percent", "saver")),
            ("left", ctypes.c_uint32),
            ("full", ctypes.c_uint32),
        )

    def battery() -> Battery | None:
        status = _PowerStatus()
        if not ctypes.windll.kernel32.GetSystemPowerStatus(ctypes.byref(status)):
            return None
        no_battery, unknown = status.flags & 128, status.percent > 100  # 255
        return None if no_battery or unknown else Battery(status.percent, status.ac == 1)
else:

    def battery(root: Path = Path("/")) -> Battery | None:
        """Of several the mean. Those of a mouse or pen don't count."""
        supplies = [
            folder for folder in _folders(root / "sys/class/power_supply") if _text(folder / "scope") != "Device"
        ]
        batteries = [folder for folder in supplies if _text(folder / "type") == "Battery"]
        charges = [int(text) for folder in batteries if (text := _text(folder / "capacity")).isdecimal()]
        if not charges:
            return None
        states = {_text(folder / "status") for folder in batteries}
        is_plugged = any(_text(folder / "online") == "1" for folder in supplies)  # a weak charger does not charge
        is_charging = "Discharging" not in states and (is_plugged or bool(states & {"Charging", "Full"}))
        return Battery(min(100, sum(charges) / len(charges)), is_charging)


# ---------------------------------------------------------------------- the network
def has_network(root: Path = Path("/")) -> bool | None:
    """Whether there is a route to others over an interface that is connected."""
    header, *lines = _text(root / "proc/net/route").splitlines() or [""]
    if not header.startswith("Iface"):
        return None
    ipv4 = [words for line in lines if len(words := line.split()) > 3]
    ipv6 = [words for line in _text(root / "proc/net/ipv6_route").splitlines() if len(words := line.split()) == 10]
    routes = [(words[0], words[3]) for words in ipv4]
    routes += [(words[9], words[8]) for words in ipv6 if not words[0].startswith(TO_NO_ROBOT)]
    return any(_is_usable(root, interface, flags) for interface, flags in routes)


def _is_usable(root: Path, interface: str, flags: str) -> bool:
    with suppress(ValueError):
        is_down = _text(root / "sys/class/net" / interface / "operstate") in ("down", "lowerlayerdown", "dormant")
        return interface != "lo" and bool(int(flags, 16) & ROUTE_IS_UP) and not is_down
    return False


# ---------------------------------------------------------------------- files of the system
def _text(path: Path) -> str:
    """Empty if it can't be read."""
    with suppress(OSError):
        return path.read_text(encoding="utf-8", errors="replace").strip()
    return ""


def _folders(path: Path) -> list[Path]:
    with suppress(OSError):
        return [path / name for name in sorted(os.listdir(path))]
    return []
