"""Everything but secrets is in an export, and every export can be read in elsewhere and comes out again unchanged."""

from __future__ import annotations

import json
from datetime import date, datetime, time, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from app.domain.message import render
from app.domain.models import (
    FONT_SCALES,
    KEYBOARDS,
    THEMES,
    WEEKDAYS,
    Between,
    DayException,
    IdleRule,
    InvalidInput,
    Mission,
    Overlap,
    Robot,
    Schedule,
    Settings,
)
from app.domain.names import cleaned
from app.i18n import translation
from app.services.catalogue.configuration import export_configuration
from app.services.catalogue.configuration.import_lines import of_setting
from app.services.catalogue.fields import CALENDAR
from tests.support.edits import add_days, switch_robot
from tests.support.examples import examples
from tests.unit.catalogue.configured import FULL, World

NAMES = (
    st.text(st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp")), min_size=1, max_size=20)
    .map(cleaned)
    .filter(bool)
)
DAYS = st.dates(date(2026, 11, 1), date(2027, 2, 1))
PERCENT = st.none() | st.floats(0, 100)
WINDOW = st.none() | st.integers(0, 1440)
PARAMETERS = st.dictionaries(
    NAMES, st.none() | st.booleans() | st.integers(-9, 9) | st.floats(0, 1) | NAMES, max_size=2
)
RULES = st.sampled_from([None, "FREQ=DAILY", "FREQ=WEEKLY;BYDAY=SA,SU", "FREQ=MINUTELY;INTERVAL=30"])
SETTINGS: dict[str, st.SearchStrategy[Any]] = {
    "poll_interval_seconds": st.integers(1, 3600),
    "retry_limit": st.integers(0, 20),
    "minimum_battery_percent": PERCENT,
    "timezone": st.sampled_from(["Europe/Helsinki", "UTC"]),
    "start_window_minutes": st.integers(0, 1440),
    "unknown_outcome_quiet_seconds": st.integers(5, 600),
    "history_limit": st.none() | st.integers(1, 10**6),
    "language": st.sampled_from(["en", "fi"]),
    "theme": st.sampled_from(THEMES),
    "gloves": st.booleans(),
    "alarm_sound": st.booleans(),
    "dim_from": st.none() | st.integers(0, 23),
    "dim_until": st.integers(0, 23),
    "font_scale_percent": st.sampled_from(FONT_SCALES),
    "keyboard": st.sampled_from(KEYBOARDS),
}
WORKING = st.lists(st.sampled_from(WEEKDAYS), min_size=1, unique=True)
COUNTRIES = st.sampled_from([("", ""), ("FI", ""), ("FI", "01"), ("DE", "BY")])
EXCEPTIONS = st.lists(
    st.builds(
        lambda name, first, length, *others: DayException(name, first, first + timedelta(days=length), *others),
        NAMES,
        DAYS,
        st.integers(0, 9),
        st.booleans(),
        st.booleans(),
        st.sampled_from(["", "plant.ics", "x" * 200 + ".ics"]),
    ),
    max_size=5,
)


@st.composite
def catalogues(draw: st.DrawFn, tablet: World) -> None:
    """Fill one as people do, in any order: what was entered under other working days stays."""
    catalogue = tablet.catalogue
    robots = [
        catalogue.save_robot(
            Robot(name, f"http://10.0.0.{n}", "user" if draw(st.booleans()) else "", enabled=draw(st.booleans()))
        )
        for n, name in enumerate(draw(st.lists(NAMES, max_size=3, unique=True)))
    ]
    robots = [catalogue.save_robot(robot, "secret") if robot.username else robot for robot in robots]
    for robot in robots:
        if not robot.needs_password and draw(st.booleans()):
            switch_robot(catalogue, robot.id, False)
    minutes = st.none() | st.integers(1, 1440)
    for name in draw(st.lists(NAMES, max_size=3, unique=True)):
        for owner in (None, *robots):
            if draw(st.booleans()):
                catalogue.save_mission(
                    Mission(
                        name,
                        f"g{draw(st.integers(1, 99))}",
                        robot_id=owner and owner.id,
                        favourite=draw(st.booleans()),
                        usual_minutes=draw(minutes),
                    )
                )
    _draw_days(draw, tablet)
    for robot in robots:
        available = catalogue.missions_of(robot.id)
        if available and draw(st.booleans()):
            rule = IdleRule(draw(st.sampled_from(available)).id, draw(st.integers(5, 30)), draw(st.booleans()))
            catalogue.change_idle_rule(
                robot.id, mission_id=rule.mission_id, after_minutes=rule.after_minutes, enabled=rule.enabled
            )
        for mission in available:
            _draw_schedule(draw, tablet, robot, mission)
    _draw_days(draw, tablet)


def _draw_days(draw: st.DrawFn, tablet: World) -> None:
    country, region = draw(COUNTRIES)
    tablet.catalogue.change_settings(
        working_days=tuple(draw(WORKING)),
        holiday_country=country,
        holiday_subdivision=region,
        **{name: draw(values) for name, values in SETTINGS.items()},
    )
    add_days(tablet.catalogue, draw(EXCEPTIONS))


def _draw_schedule(draw: st.DrawFn, tablet: World, robot: Robot, mission: Mission) -> None:
    recurrence = draw(RULES)
    between = (
        Between(time(6, 30), time(17)) if recurrence and "MINUTELY" in recurrence and draw(st.booleans()) else None
    )
    schedule = Schedule(
        "",
        robot.id,
        mission.id,
        datetime.combine(draw(DAYS), time(6, 30)),
        draw(SETTINGS["timezone"]),
        recurrence,
        enabled=draw(st.booleans()),
        between=between,
        minimum_battery_percent=draw(PERCENT),
        respect_working_days=draw(st.booleans()),
        start_window_minutes=draw(WINDOW),
        overlap=draw(st.sampled_from((Overlap.SKIP, Overlap.QUEUE))),
        priority=draw(st.integers(-9, 9)),
        parameters=draw(PARAMETERS),
    )
    try:
        tablet.catalogue.save_schedule(schedule)
    except InvalidInput as error:
        if error.field != "start":  # of one time, on a day off
            raise


@examples(60, deadline=None)
@given(st.data())
def test_every_export_is_taken_by_an_empty_directory_and_comes_out_the_same(data):
    with TemporaryDirectory() as directory:
        tablet, other = World(Path(directory) / "one"), World(Path(directory) / "other")
        try:
            data.draw(catalogues(tablet))
            exported = tablet.export()
            assert "secret" not in json.dumps(exported)
            other.take(exported)
            assert other.export() == without_passwords(exported)
            other.take(with_passwords(exported))
            assert other.export() == exported
            assert other.take(exported) == []
        finally:
            tablet.db.close()
            other.db.close()


def without_passwords(exported: dict[str, Any]) -> dict[str, Any]:
    """No robot is on before its password has been entered."""
    return {**exported, "robots": [{**robot, "enabled": False} for robot in exported["robots"]]}


def with_passwords(exported: dict[str, Any]) -> dict[str, Any]:
    """That of every robot that has one."""
    return {
        **exported,
        "robots": [{**robot, "password": "secret"} if robot["username"] else robot for robot in exported["robots"]],
    }


def test_closed_and_extra_days_country_favourites_and_display_come_along(tablet, tmp_path):
    tablet.take(FULL)
    tablet.catalogue.set_public_holidays("DE", "BY")
    add_days(
        tablet.catalogue,
        [
            DayException("Inventory", date(2026, 12, 7), date(2026, 12, 8)),
            DayException("Saturday", date(2026, 11, 28), date(2026, 11, 28), is_working=True, source="plant.ics"),
        ],
    )
    tablet.catalogue.save_mission(Mission("Fetch", "g", favourite=True))
    tablet.catalogue.change_settings(language="fi", theme="dark", gloves=True, font_scale_percent=115, keyboard="on")
    tablet.catalogue.save_schedule(
        Schedule("", tablet.robots["R1"].id, tablet.missions[0].id, datetime(2026, 11, 28, 9, 0), "UTC")
    )
    exported = tablet.export()
    other = World(tmp_path / "other")
    lines = other.take(exported)  # a Saturday that would be refused without its day
    assert [line for line in lines if "days " in line or "Working" in line or "Region" in line or "mode" in line] == [
        "Working days: Mon, Tue, Wed, Thu, Fri → Mon, Tue",
        "Glove mode: no → yes",
        "Region: none → Bayern",
        "days off added: Inventory",
        "extra working days added: Saturday",
    ]
    assert other.export() == without_passwords(exported)
    assert exported["calendar"] == {
        "country": "DE",
        "region": "BY",
        "days": [
            {
                "name": "Inventory",
                "first_day": "2026-12-07",
                "last_day": "2026-12-08",
                "working": False,
                "yearly": False,
            },
            {
                "name": "Saturday",
                "first_day": "2026-11-28",
                "last_day": "2026-11-28",
                "working": True,
                "yearly": False,
                "source": "plant.ics",
            },
        ],
    }
    assert exported["display"] == {
        "language": "fi",
        "theme": "dark",
        "gloves": True,
        "font_scale_percent": 115,
        "keyboard": "on",
        "alarm_sound": True,
        "dim_from": None,
        "dim_until": 6,
    }
    assert {"name": "Fetch", "guid": "g", "favourite": True} in exported["missions"]
    assert other.take(exported) == []
    other.db.close()


def test_a_one_time_start_whose_day_was_closed_later_is_exported_as_it_will_run(tablet, tmp_path):
    tablet.take(FULL)
    tablet.catalogue.change_settings(working_days=("WE",))  # "Home on R1" is on a Tuesday
    exported = tablet.export()
    assert exported["schedules"][0]["respect_working_days"] is False
    other = World(tmp_path / "other")
    other.take(exported)
    assert other.export() == without_passwords(exported)
    assert other.schedules["Home on R1"].next_at == tablet.schedules["Home on R1"].next_at
    other.db.close()


def test_a_country_has_its_name_in_the_language_of_the_app():
    country = next(field for field in CALENDAR if field.key == "country")
    line = of_setting(country, Settings(), Settings(holiday_country="DE"))
    assert render(line, translation("fi").gettext).endswith(" → Saksa")


def test_another_country_has_no_region_of_the_former(tablet):
    tablet.take({"format": FULL["format"], "calendar": {"country": "DE", "region": "BY"}})
    assert tablet.take({"format": FULL["format"], "calendar": {"country": "FI"}}) == [
        "Public holidays: Germany → Finland",
        "Region: Bayern → none",
    ]
    assert json.loads(export_configuration(tablet.db.read()))["calendar"] == {
        "country": "FI",
        "region": None,
        "days": [],
    }
