"""What a check-up finds of each robot that is built into the simulator as one that differs, written by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from app.domain.check_up import Rest, RobotProfile

GERMAN = {"Ausstehend": "Pending", "Aktiv": "Executing", "Abbruch": "Abort", "Fertig": "Done", "Abgebrochen": "Aborted"}
FAITHFUL = RobotProfile(
    None,
    None,
    has_search=True,
    page_limit=0,
    ignores=frozenset(),
    token_field="description",
    item_states={state: state for state in GERMAN.values()},
    cancelled_message="Aborted - User Request",
    gives_id=True,
    order_status=201,
    timezone="Europe/Copenhagen",
    clock_offset=0.0,
    latency=(0.02, 0.02, 0.02, 0.02),
    lost=0.0,
    priority_counts=True,
)
DIFFERS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "faithful": {},
        "cancelled": {
            "item_states": {
                "Pending": "Pending",
                "Executing": "Executing",
                "Done": "Done",
                "Cancelled": "Cancelled",
                "Aborted": "Aborted",
            },
            "cancelled_message": None,
        },
        "fleet": {},
        "forgets-descriptions": {"token_field": ""},
        "german-states": {"item_states": GERMAN},
        "german-texts": {"cancelled_message": "Abgebrochen - Benutzeranforderung"},
        "ignores-sort": {"ignores": frozenset({"sort_by"})},
        "moves-descriptions": {"token_field": "order_description"},
        "no-id": {"gives_id": False},
        "no-search": {"has_search": False},
        "other-zone": {"timezone": "Asia/Tokyo"},
        "pages-of-50": {"page_limit": 50},
        "reboots-under-load": {"rest": Rest(30, 7.5)},
        "renames-descriptions": {"token_field": ""},
        "slow-disk": {"latency": (3.0, 6.0, 8.7, 9.0), "quiet_s": 90.0, "timeout_s": 18.0},
    }
)


def checked_up(name: str, serial_number: str | None, software: str | None) -> RobotProfile:
    return replace(FAITHFUL, serial_number=serial_number, software=software, **DIFFERS[name])
