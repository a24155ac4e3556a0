"""Facts of an invented plant, as the Scheduler's presenters take them: Friday 20 Nov 2026, 14:38 in Helsinki."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

from app.domain.execution import DurationEstimate, Execution, Trigger
from app.domain.models import Mission, Robot, Schedule, Settings
from app.screens.scheduler.facts import SchedulerFacts
from app.services.planning.planned import PlannedRun
from app.services.planning.working_days import WorkingCalendar

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)  # Friday, 14:38 in Helsinki
HELSINKI = ZoneInfo("Europe/Helsinki")
SETTINGS = Settings(timezone="Europe/Helsinki", minimum_battery_percent=30)
EVERY_DAY = replace(SETTINGS, working_days=("MO", "TU", "WE", "TH", "FR", "SA", "SU"))
AINO, VEIKKO = Robot("Aino", "http://a", id=1, model="MiR250"), Robot("Veikko", "http://b", id=2, enabled=False)
KITS, EMPTIES = Mission("Deliver kits", "g-kits", id=1), Mission("Collect empties", "g-empties", id=2)
HOURLY = Schedule(
    "Kits",
    1,
    1,
    datetime(2026, 11, 2, 6, 0),
    "Europe/Helsinki",
    "FREQ=DAILY",
    id=7,
    next_at=NOW + timedelta(minutes=22),
)


def facts(**values):
    return SchedulerFacts(
        **{
            "settings": SETTINGS,
            "calendar": WorkingCalendar(values.get("settings", SETTINGS)),
            "robots": (AINO, VEIKKO),
            "missions": (KITS, EMPTIES),
            "schedules": (HOURLY,),
            **values,
        }
    )


def planned(minutes, usual_s=420.0, schedule=HOURLY, robot=AINO, mission=KITS, **values):
    usual = None if usual_s is None else DurationEstimate(usual_s, **{"slow_s": usual_s, **values})
    return PlannedRun(NOW + timedelta(minutes=minutes), schedule, robot, mission, usual)


def execution(state, minutes_ago, **values):
    at = NOW - timedelta(minutes=minutes_ago)
    return Execution(
        **{
            "trigger": Trigger.SCHEDULED,
            "robot_id": 1,
            "robot": "Aino",
            "mission": "Deliver kits",
            "mission_guid": "g-kits",
            "planned_at": at,
            "closes_at": at + timedelta(minutes=15),
            "created_at": at,
            "token": "t",
            "id": 70,
            "timezone": "Europe/Helsinki",
            "state": state,
            **values,
        }
    )
