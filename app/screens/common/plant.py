"""The plant as screens read it: the settings, robots and groups, and which of them something names. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.models import Group, Robot, Settings
from app.screens.common.name_order import with_id


@dataclass(frozen=True)
class Plant:
    """Robots and groups in order of name."""

    settings: Settings = field(default_factory=Settings)
    robots: tuple[Robot, ...] = ()
    groups: tuple[Group, ...] = ()

    @property
    def zone(self) -> ZoneInfo:
        return ZoneInfo(self.settings.timezone)

    def robot(self, robot_id: int | None) -> Robot | None:
        return with_id(self.robots, robot_id)

    def group(self, group_id: int | None) -> Group | None:
        return with_id(self.groups, group_id)

    def members(self, group_id: int | None) -> tuple[Robot, ...]:
        """In order of name."""
        group = self.group(group_id)
        return tuple(robot for robot in self.robots if group is not None and robot.id in group.members)

    def target(self, named: Any) -> Robot | Group | None:
        """Whom a schedule, a draft of one or a run is for, if that still exists."""
        return self.robot(named.robot_id) if named.group_id is None else self.group(named.group_id)
