"""A configuration file with everything in it, and an app that takes it."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import Any

from app.database.connection import Database
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain.message import Message, render
from app.domain.models import (
    Mission,
    Robot,
    Schedule,
    Settings,
)
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.configuration import FORMAT, export_configuration, import_configuration
from tests.support.clock import VirtualClock

FULL: dict[str, Any] = {
    "format": FORMAT,
    "settings": {
        "poll_interval_seconds": 20,
        "retry_limit": 5,
        "minimum_battery_percent": 15,
        "working_days": ["MO", "TU"],
        "timezone": "Europe/Helsinki",
        "start_window_minutes": 30,
        "unknown_outcome_quiet_seconds": 60,
        "history_limit": None,
    },
    "robots": [
        {
            "name": "R1",
            "address": "http://192.168.12.20",
            "username": "distributor",
            "password": "secret",
            "enabled": True,
            "idle": {"mission": "Home", "after_minutes": 7, "enabled": False},
        },
        {
            "name": "R2",
            "address": "https://r2.local:8443",
            "username": "admin",
            "password": "other",
            "certificate_sha256": "AB" * 32,
        },
    ],
    "missions": [
        {"name": "Deliver", "guid": "3d7c7c40-ce85-11ef-904a-000e8e9884eb"},
        {"name": "Home", "guid": "home-1"},
        {"name": "Home", "guid": "home-2", "robot": "R1"},
    ],
    "schedules": [
        {
            "name": "Morning",
            "robot": "R1",
            "mission": "Deliver",
            "start": "2026-11-23T09:30",
            "timezone": "Europe/Paris",
            "recurrence": "FREQ=MINUTELY;INTERVAL=30;BYDAY=MO,WE,FR",
            "enabled": True,
            "minimum_battery_percent": 30,
            "respect_working_days": False,
            "between": {"from": "08:30", "to": "16:45"},
            "start_window_minutes": 0,
            "overlap": "queue",
            "priority": 3,
            "parameters": {"speed": 0.5, "place": "Ä"},
        },
        {"robot": "R1", "mission": "Home", "start": "2026-11-24T06:30"},
    ],
}


class World:
    def __init__(self, path) -> None:
        self.clock = VirtualClock()  # Monday 2026-11-23 06:00 UTC
        self.db = Database.open(path / "data" / "a.db", clock=self.clock, threaded=False, durable=False)
        self.catalogue = Catalogue(self.db, self.clock)

    def take(self, document: Any = None, **sections: Any) -> list[str]:
        """What an import of a document changes, or of one with only these sections."""
        return [
            render(line)
            for line in self.take_in_parts({"format": FORMAT, **sections} if document is None else document)
        ]

    def take_in_parts(self, document: Any) -> list[Message]:
        return import_configuration(
            self.catalogue, document if isinstance(document, bytes) else json.dumps(document).encode()
        )

    def export(self) -> dict[str, Any]:
        return json.loads(export_configuration(self.db.read()))

    @property
    def robots(self) -> dict[str, Robot]:
        return {robot.name: robot for robot in RobotRepository().all(self.db.read())}

    @property
    def missions(self) -> list[Mission]:
        return MissionRepository().all(self.db.read())

    @property
    def schedules(self) -> dict[str, Schedule]:
        return {schedule.name: schedule for schedule in ScheduleRepository().all(self.db.read())}

    @property
    def settings(self) -> Settings:
        return SettingsRepository().load(self.db.read())

    def everything(self) -> object:
        return "\n".join(self.db.read().iterdump())


def changed(path: str, value: Any) -> dict[str, Any]:
    """FULL with one value replaced: ``schedules.0.start``."""
    document = deepcopy(FULL)
    *parents, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    place = document
    for parent in parents:
        place = place[parent]
    place[last] = value
    return document
