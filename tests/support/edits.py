"""Changes of the plan that no screen makes in this way."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from app.container import Container
from app.domain.models import DayException, Robot
from app.services.catalogue import robot_edit, settings_edit
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.configuration import import_configuration


def import_file(catalogue: Catalogue, **sections: Any) -> list[str]:
    """A configuration of these sections. Returns what has changed."""
    content = json.dumps({"format": "amr-scheduler/1", **sections})
    return import_configuration(catalogue, content.encode())


def skip_next(container: Container, schedule_id: int) -> datetime:
    """The next start of a schedule, which is returned."""
    at = container.catalogue.schedule(schedule_id).next_at
    container.pausing.skip(schedule_id, at)
    return at


def switch_robot(catalogue: Catalogue, robot_id: int, on: bool) -> Robot:
    """On, unless it needs a password, or off."""
    return catalogue.edit(lambda edit: robot_edit.save(edit, replace(edit.the(Robot, robot_id), enabled=on)))


def add_days(catalogue: Catalogue, exceptions: Sequence[DayException]) -> list[DayException]:
    """All or none, as of an imported calendar."""
    return catalogue.edit(lambda edit: settings_edit.save_days(edit, exceptions))
