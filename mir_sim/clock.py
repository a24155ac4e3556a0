"""The robot's own clock: an offset, a drift and a time zone on top of simulated time."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

SECONDS_PER_DAY = 86_400.0


class RobotClock:
    """Converts simulated seconds into the time that the robot's clock shows.

    Args:
        start: true time at simulated second 0; naive values mean UTC.
        zone: IANA name of the zone in which the robot writes its naive timestamps.
        offset: seconds the robot's clock is ahead of true time at simulated second 0.
        drift: seconds it gains per simulated day; about 1 is reported for robots that have no time server.
    """

    def __init__(self, start: datetime, zone: str = "UTC", offset: float = 0.0, drift: float = 0.0) -> None:
        self.start = start if start.tzinfo else start.replace(tzinfo=UTC)
        self.zone = zone
        self.offset = offset
        self.drift = drift
        self.tz = ZoneInfo(zone)

    def set_zone(self, zone: str) -> None:
        """Change the zone. Raises ZoneInfoNotFoundError or ValueError for a name that is not a zone."""
        self.tz = ZoneInfo(zone)
        self.zone = zone

    def error(self, seconds: float) -> float:
        """Seconds by which the robot's clock is ahead of true time."""
        return self.offset + self.drift * seconds / SECONDS_PER_DAY

    def utc(self, seconds: float) -> datetime:
        return self.start + timedelta(seconds=seconds + self.error(seconds))

    def local(self, seconds: float) -> datetime:
        """Naive local time, as the robot shows it."""
        return self.utc(seconds).astimezone(self.tz).replace(tzinfo=None)

    def stamp(self, seconds: float) -> str:
        """``YYYY-MM-DDTHH:MM:SS``: whole seconds, no zone, as recorded on robots."""
        return self.local(seconds).isoformat(timespec="seconds")

    def set_local(self, value: datetime, seconds: float) -> None:
        """Set the clock so that it shows ``value`` (naive: local time of the robot) at this simulated second."""
        aware = value if value.tzinfo else value.replace(tzinfo=self.tz)
        self.offset += (aware - self.utc(seconds)).total_seconds()
