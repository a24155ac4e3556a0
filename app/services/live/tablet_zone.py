"""The tablet's time zone and its source: its clock's display decides.

The clock follows TZ, where that is set, and else /etc/localtime, a link to a zone or a copy of one; a copy and a rule
have no name, so they are compared with the known zones. /etc/timezone repeats it, but many systems no longer update it.
Windows says it in its registry.
"""

from __future__ import annotations

import io
import os
import posixpath
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from importlib.resources import files
from itertools import chain, pairwise
from pathlib import Path
from zoneinfo import ZoneInfo

from app.domain.clock import EARLIEST, zone_names
from app.services.live.windows import registry_value

LOCALTIME, TIMEZONE_FILE = "/etc/localtime", "/etc/timezone"
DIRECTORY = "/usr/share/zoneinfo"
MOST_LINKS = 40
LARGEST_FILE = 100_000  # bytes; the longest histories have 4,000
STEP = timedelta(days=4, hours=7)  # between the moments at which zones are compared
SETTLED_AFTER = timedelta(days=730)  # zone data of different ages agree on what is longer ago
LEAST_AGREEMENT = 0.9  # of the moments a file shows the time of the zone whose name it has, or that name is wrong


@dataclass(frozen=True)
class TabletZone:
    """``name`` is an IANA name. ``source`` is its origin: TZ, /etc/localtime, /etc/timezone, Windows; "" if there is
    none. If it is not certain, a person has to be asked."""

    name: str
    source: str
    is_certain: bool


NOT_KNOWN = TabletZone("UTC", "", False)


@dataclass(frozen=True)
class WindowsZone:
    """``key`` is Windows' own name, such as FLE Standard Time; ``country`` the ISO 3166 code of the region that the
    user chose, or "". ``keeps_standard_time``: its clock is not set ahead in summer, even if the zone's is."""

    key: str
    country: str = ""
    keeps_standard_time: bool = False


def read_registry() -> WindowsZone | None:
    """None on other systems than Windows."""
    zones = r"SYSTEM\CurrentControlSet\Control\TimeZoneInformation"
    if not (key := registry_value("HKEY_LOCAL_MACHINE", zones, "TimeZoneKeyName")):
        return None
    return WindowsZone(
        key,
        registry_value("HKEY_CURRENT_USER", r"Control Panel\International\Geo", "Name"),
        registry_value("HKEY_LOCAL_MACHINE", zones, "DynamicDaylightTimeDisabled") == "1",
    )


def tablet_zone(
    root: Path = Path("/"),
    environ: Mapping[str, str] = os.environ,
    registry: Callable[[], WindowsZone | None] = read_registry,
    now: datetime | None = None,
) -> TabletZone:
    """The zone of the machine whose files are below ``root``. Raises nothing."""
    finder = _Finder(root, _country(environ), max(EARLIEST, now or datetime.now(UTC)))
    variable, windows = environ.get("TZ", "").strip().removeprefix(":"), registry()
    if variable and (found := finder.from_variable(variable)):
        return found
    found = (
        (windows and from_windows(windows, finder))
        or finder.from_file(LOCALTIME, LOCALTIME)
        or (
            TabletZone(note, TIMEZONE_FILE, False) if (note := finder.noted_name()) else NOT_KNOWN
        )  # the clock shows UTC
    )
    # a TZ that can't be read shows UTC, and so does a system that was never set up
    return replace(found, is_certain=False) if variable or found.name not in _places() else found


def _country(environ: Mapping[str, str]) -> str:
    """Of the language that the system is set to: fi_FI.UTF-8."""
    locales = (environ.get(name, "").partition(".")[0].partition("@")[0] for name in ("LC_ALL", "LC_TIME", "LANG"))
    return next((locale.rpartition("_")[2] for locale in locales if "_" in locale), "")


def from_windows(windows: WindowsZone, finder: _Finder) -> TabletZone:
    """Windows has one zone for several countries; the region distinguishes them."""
    from icalendar.timezone.windows_to_olson import WINDOWS_TO_OLSON  # takes a while, and only Windows needs it

    name = WINDOWS_TO_OLSON.get(windows.key)
    if name not in zone_names():
        return NOT_KNOWN
    names = finder.matching(ZoneInfo(name), finder.coming_year(), with_words=True)
    places = [place for place in _places().values() if place.name in names]
    there = [place for place in places if place.country == windows.country] or places
    is_known = not there or name in [place.name for place in there if place.country == windows.country]
    found = name if is_known or len(there) > 1 else there[0].name
    return TabletZone(found, "Windows", (is_known or len(there) == 1) and not windows.keeps_standard_time)


class _Finder:
    def __init__(self, root: Path, country: str, now: datetime) -> None:
        self._root, self._country, self._now = root, country, now

    # ------------------------------------------------------------------ where it is said
    def from_variable(self, text: str) -> TabletZone | None:
        """A name, a path, or a rule such as EET-2EEST,M3.5.0/3,M10.5.0/4; None if it is something else."""
        if (name := text.removeprefix("posix/").removeprefix("right/")) in zone_names():
            return TabletZone(name, "TZ", True)
        if text.startswith("/"):
            return self.from_file(text, "TZ")
        rule = _zone_of(_file_from_rule(text))
        return None if rule is None else self._closest(rule, "TZ", self.coming_year())

    def from_file(self, path: str, source: str) -> TabletZone | None:
        """A link has the name of its target, unless that was replaced, as in a container."""
        steps = list(self._steps(path))
        name = next((name for step in steps if (name := _name_in(step))), "")
        zone = _zone_of(self._content(steps[-1]))
        past = self._moments(datetime(1970, 1, 1, tzinfo=UTC), self._now - SETTLED_AFTER)
        if name and (zone is None or _agreement(zone, ZoneInfo(name), past) > LEAST_AGREEMENT):
            return TabletZone(name, source, True)
        return None if zone is None else self._closest(zone, source, past)

    def noted_name(self) -> str:
        lines = (self._content(TIMEZONE_FILE) or b"").decode("ascii", errors="replace").split("\n")
        return next((name for line in lines if (name := line.partition("#")[0].strip()) in zone_names()), "")

    def _steps(self, path: str) -> Iterator[str]:
        """The path and where its links lead, one after the other."""
        for _ in range(MOST_LINKS):
            yield path
            try:
                path = posixpath.normpath(posixpath.join(posixpath.dirname(path), os.readlink(self._below_root(path))))
            except OSError:  # no link
                return

    def _content(self, path: str) -> bytes | None:
        try:
            with self._below_root(path).open("rb") as file:
                return file.read(LARGEST_FILE)
        except (OSError, ValueError):
            return None

    def _below_root(self, path: str) -> Path:
        return self._root / path.lstrip("/")

    # ------------------------------------------------------------------ which of the known ones it is
    def _closest(self, zone: ZoneInfo, source: str, moments: list[datetime]) -> TabletZone | None:
        """The known zone that shows the same times at these moments, or None."""
        if not (found := self.matching(zone, moments, with_words=True)):
            lately = self.matching(zone, self._moments(self._now - timedelta(days=365), self._now))
            return TabletZone(self._best(lately), source, False) if lately else None
        unsettled = self._moments(self._now - SETTLED_AFTER, self._now)
        found = {name for name in found if _agreement(zone, ZoneInfo(name), unsettled) == 1} or found
        if (note := self.noted_name()) in found:
            return TabletZone(note, source, True)
        return TabletZone(self._best(found), source, len(found & _places().keys()) <= 1)

    def _best(self, names: Iterable[str]) -> str:
        """That of a place, of this country, of the larger city."""
        places, names = _places(), set(names)
        if found := [place for name, place in places.items() if name in names]:
            return min(found, key=lambda place: (place.country != self._country, place.rank)).name
        return "UTC" if "UTC" in names else min(names, key=lambda name: ("/" not in name, name))

    def matching(self, zone: ZoneInfo, moments: list[datetime], *, with_words: bool = False) -> set[str]:
        """Names of the zones that show the same time, ``with_words`` also the same abbreviation (EET), by the system's
        own data, or the app's."""
        moments = _with_changes(moments, zone)
        wanted = [_local_time(moment, zone, with_words) for moment in moments]

        def all_agree(other: ZoneInfo | None) -> bool:
            return other is not None and all(
                _local_time(moment, other, with_words) == seen for moment, seen in zip(moments, wanted, strict=True)
            )

        found = {name for name in zone_names() if all_agree(_zone_of(self._content(f"{DIRECTORY}/{name}")))}
        # no other file lies in its place
        found = {name for name in found if _agreement(zone, ZoneInfo(name), moments) > LEAST_AGREEMENT}
        return found or {name for name in zone_names() if all_agree(ZoneInfo(name))}

    def coming_year(self) -> list[datetime]:
        return self._moments(self._now, self._now + timedelta(days=365))

    @staticmethod
    def _moments(begin: datetime, end: datetime) -> list[datetime]:
        return [begin + number * STEP for number in range(max(1, (end - begin) // STEP))]


def _agreement(zone: ZoneInfo, other: ZoneInfo, moments: list[datetime]) -> float:
    """At what share of these moments both show the same time."""
    return sum(_local_time(moment, zone) == _local_time(moment, other) for moment in moments) / len(moments)


def _local_time(moment: datetime, zone: ZoneInfo, with_words: bool = False) -> tuple[timedelta | None, str | None]:
    local = moment.astimezone(zone)
    return local.utcoffset(), local.tzname() if with_words else None


def _with_changes(moments: list[datetime], zone: ZoneInfo) -> list[datetime]:
    """Those around a change of the clock every hour: some zones differ by the hour of their changes only."""
    around = [
        [low + number * timedelta(hours=1) for number in range(STEP // timedelta(hours=1))]
        for low, high in pairwise(moments)
        if _local_time(low, zone) != _local_time(high, zone)
    ]
    return [*moments, *chain.from_iterable(around)]


def _name_in(path: str) -> str:
    """The zone that the end of a path names: /usr/share/zoneinfo/posix/Europe/Helsinki."""
    parts = path.strip("/").split("/")
    return next((name for start in range(len(parts)) if (name := "/".join(parts[start:])) in zone_names()), "")


def _zone_of(content: bytes | None) -> ZoneInfo | None:
    """None if it is not a zone."""
    try:
        return None if content is None else ZoneInfo.from_file(io.BytesIO(content))
    except (ValueError, OSError, struct.error, EOFError, LookupError):
        return None


def _file_from_rule(rule: str) -> bytes | None:
    """As in a file of zone data (RFC 9636) without a history. None if that can't represent it."""
    if not rule.isascii() or "\n" in rule:
        return None

    def block(version: bytes) -> bytes:
        return (
            b"TZif"
            + version
            + bytes(15)
            + struct.pack(">6l", 0, 0, 0, 0, 1, 4)
            + struct.pack(">lBB", 0, 0, 0)
            + b"UTC\0"
        )

    return block(b"2") + block(b"2") + b"\n" + rule.encode("ascii") + b"\n"


@dataclass(frozen=True)
class _Place:
    """A zone that belongs to a country."""

    name: str
    country: str
    rank: int  # the canonical zones first


@lru_cache(maxsize=1)
def _places() -> Mapping[str, _Place]:
    """By name; zones of UTC and of abbreviations belong to none."""
    canonical, all_of_them = (
        [
            line.split("\t")
            for line in files("tzdata").joinpath("zoneinfo", table).read_text("utf-8").splitlines()
            if line and not line.startswith("#")
        ]
        for table in ("zone1970.tab", "zone.tab")
    )
    ranks = {row[2]: rank for rank, row in enumerate(canonical)}
    return {row[2]: _Place(row[2], row[0], ranks.get(row[2], len(ranks))) for row in all_of_them}
