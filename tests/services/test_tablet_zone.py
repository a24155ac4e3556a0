"""Which time zone the tablet has: on Linux, in a container and on Windows; and what a first start makes of it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from app.container import Container
from app.database.connection import Database
from app.domain.models import Mission, Robot, Schedule
from app.services.live.tablet_zone import LOCALTIME, TIMEZONE_FILE, TabletZone, WindowsZone, read_registry, tablet_zone
from tests.support.clock import VirtualClock
from tests.support.edits import import_file
from tests.support.zone_files import file_of_rule, put, zone_file

NOW = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
RULE = "EET-2EEST,M3.5.0/3,M10.5.0/4"
ZONES = "/usr/share/zoneinfo"


class Machine:
    """Files and links below a directory."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def link(self, path: str, target: str) -> Machine:
        file = self.root / path.lstrip("/")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.symlink_to(target)
        return self

    def file(self, path: str, content: bytes | str) -> Machine:
        put(self.root, path, content)
        return self

    def zone(self, *, windows: WindowsZone | None = None, now: datetime = NOW, **environ: str) -> TabletZone:
        return tablet_zone(self.root, environ, lambda: windows, now)


@pytest.fixture
def machine(tmp_path):
    return Machine(tmp_path)


# ---------------------------------------------------------------------- /etc/localtime and /etc/timezone
@pytest.mark.parametrize(
    "target",
    [
        f"{ZONES}/Europe/Helsinki",
        "../usr/share/zoneinfo/Europe/Helsinki",
        f"{ZONES}/posix/Europe/Helsinki",
        f"{ZONES}/right/Europe/Helsinki",
        "/etc/zoneinfo/Europe/Helsinki",
        "/var/db/timezone/zoneinfo/Europe/Helsinki",
    ],
)
def test_the_link_counts_and_not_the_note_that_is_not_kept_up(machine, target):
    machine.link(LOCALTIME, target).file(TIMEZONE_FILE, "Etc/UTC\n")
    assert machine.zone() == TabletZone("Europe/Helsinki", LOCALTIME, True)


@pytest.mark.parametrize(
    ("links", "files", "environ", "found"),
    [
        pytest.param({}, {}, {}, ("UTC", "", False), id="nothing says it"),
        pytest.param(
            {
                LOCALTIME: "alternatives/zone",
                "/etc/alternatives/zone": f"{ZONES}/Europe/Mariehamn",
                f"{ZONES}/Europe/Mariehamn": "Helsinki",
            },
            {f"{ZONES}/Europe/Helsinki": zone_file("Europe/Helsinki")},
            {},
            ("Europe/Mariehamn", LOCALTIME, True),
            id="a link to a link",
        ),
        pytest.param(
            {LOCALTIME: "other", "/etc/other": "localtime"},
            {TIMEZONE_FILE: "Europe/Helsinki\n"},
            {},
            ("Europe/Helsinki", TIMEZONE_FILE, False),
            id="links in a circle",
        ),
        pytest.param(
            {LOCALTIME: f"{ZONES}/America/Vancouver"},  # since 2026 it keeps its summer time
            {f"{ZONES}/America/Vancouver": zone_file("America/Los_Angeles")},
            {},
            ("America/Vancouver", LOCALTIME, True),
            id="a link, where the system's data are old",
        ),
        pytest.param(
            {LOCALTIME: f"{ZONES}/Europe/Helsinki"},
            {},
            {"TZ": "Europe/Helsinky"},
            ("Europe/Helsinki", LOCALTIME, False),
            id="a variable that is neither name nor rule",
        ),
        pytest.param(
            {LOCALTIME: f"{ZONES}/Europe/Helsinki"},
            {},
            {"TZ": ""},
            ("Europe/Helsinki", LOCALTIME, True),
            id="an empty variable",
        ),
    ],
)
def test_what_is_found_where(machine, links, files, environ, found):
    for path, target in links.items():
        machine.link(path, target)
    for path, content in files.items():
        machine.file(path, content)
    assert machine.zone(**environ) == TabletZone(*found)


@pytest.mark.parametrize("others", [[], ["Europe/Helsinki", "Europe/Mariehamn", "Europe/Riga", "UTC"]])
def test_what_the_linked_file_holds_counts_where_a_container_put_another_in_its_place(machine, others):
    for name in others:
        machine.file(f"{ZONES}/{name}", zone_file(name))
    machine.link(LOCALTIME, f"{ZONES}/Etc/UTC").file(f"{ZONES}/Etc/UTC", zone_file("Europe/Helsinki"))
    assert machine.zone() == TabletZone("Europe/Helsinki", LOCALTIME, False)


def test_no_plant_lies_in_utc_which_an_image_has_that_was_never_set_up(machine):
    machine.link(LOCALTIME, f"{ZONES}/Etc/UTC")
    assert machine.zone() == TabletZone("Etc/UTC", LOCALTIME, False)
    assert machine.zone(TZ="Etc/UTC") == TabletZone("Etc/UTC", "TZ", True)


@pytest.mark.parametrize(
    ("name", "found", "is_certain"),
    [
        ("Europe/Helsinki", "Europe/Helsinki", False),  # Mariehamn has the same times
        ("Europe/Vienna", "Europe/Vienna", True),  # changed the hour of a change in 1980 only
        pytest.param("Asia/Tokyo", "Asia/Tokyo", True, marks=pytest.mark.long),
        pytest.param("Asia/Calcutta", "Asia/Kolkata", True, marks=pytest.mark.long),
        ("America/Vancouver", "America/Vancouver", True),
        ("Europe/London", "Europe/London", False),
        ("Etc/UTC", "UTC", False),
    ],
)
def test_a_copy_is_compared_with_the_known_zones(machine, name, found, is_certain):
    machine.file(LOCALTIME, zone_file(name))
    assert machine.zone() == TabletZone(found, LOCALTIME, is_certain)


def test_a_copy_is_compared_with_the_systems_own_data_first(machine):
    """They may be older than the app's."""
    old = file_of_rule("XST-5")
    machine.file(LOCALTIME, old).file(f"{ZONES}/Asia/Karachi", old).file(
        f"{ZONES}/Asia/Tashkent", zone_file("Asia/Tashkent")
    )
    assert machine.zone().name == "Asia/Karachi"


@pytest.mark.parametrize(
    ("note", "is_certain"),
    [("Europe/Helsinki\n", True), ("# the zone\nEurope/Mariehamn\n", True), ("Etc/UTC\n", False)],
)
def test_etc_timezone_distinguishes_zones_that_equal_a_copy(machine, note, is_certain):
    machine.file(LOCALTIME, zone_file("Europe/Helsinki")).file(TIMEZONE_FILE, note)
    zone = machine.zone()
    assert zone.is_certain is is_certain
    assert zone.name == (note.split()[-1] if is_certain else "Europe/Helsinki")


def test_a_clock_that_was_never_set_makes_no_difference(machine):
    machine.file(LOCALTIME, zone_file("Asia/Tokyo"))
    never_set = datetime(1970, 1, 1, tzinfo=UTC)
    assert machine.zone(now=never_set) == TabletZone("Asia/Tokyo", LOCALTIME, True)
    assert machine.zone(now=never_set, TZ=RULE, LANG="fi_FI").name == "Europe/Helsinki"


@pytest.mark.parametrize("content", ["", "garbage", b"TZif", b"TZif2" + bytes(200)])
def test_a_file_that_is_no_zone_says_nothing(machine, content):
    machine.file(LOCALTIME, content)
    assert machine.zone() == TabletZone("UTC", "", False)


# ---------------------------------------------------------------------- TZ
@pytest.mark.parametrize(
    "variable",
    [
        "Europe/Helsinki",
        ":Europe/Helsinki",
        f":{ZONES}/Europe/Helsinki",
        f"{ZONES}/Europe/Helsinki",
        "posix/Europe/Helsinki",
    ],
)
def test_the_variable_counts_before_the_file(machine, variable):
    machine.link(LOCALTIME, f"{ZONES}/Etc/UTC")
    assert machine.zone(TZ=variable) == TabletZone("Europe/Helsinki", "TZ", True)


@pytest.mark.parametrize(
    ("rule", "language", "found", "is_certain"),
    [
        (RULE, "fi_FI.UTF-8", "Europe/Helsinki", False),
        (RULE, "el_GR", "Europe/Athens", False),
        ("JST-9", "", "Asia/Tokyo", True),
        ("XXX-2YYY,M3.5.0/3,M10.5.0/4", "fi_FI", "Europe/Helsinki", False),
        ("UTC0", "", "UTC", True),
    ],
)
def test_a_rule_is_compared_with_the_known_zones(machine, rule, language, found, is_certain):
    machine.link(LOCALTIME, f"{ZONES}/Etc/UTC")
    assert machine.zone(TZ=rule, LANG=language) == TabletZone(found, "TZ", is_certain)


def test_a_rule_is_compared_with_the_systems_own_data_too(machine):
    for name in ("Europe/Athens", "Europe/Helsinki", "Europe/London"):
        machine.file(f"{ZONES}/{name}", zone_file(name))
    assert machine.zone(TZ=RULE, LANG="fi_FI").name == "Europe/Helsinki"


def test_a_language_without_a_country_does_not_hide_another(machine):
    assert machine.zone(TZ=RULE, LC_ALL="C.UTF-8", LANG="fi_FI.UTF-8").name == "Europe/Helsinki"


# ---------------------------------------------------------------------- Windows
@pytest.mark.parametrize(
    ("key", "country", "found", "is_certain"),
    [
        ("FLE Standard Time", "FI", "Europe/Helsinki", True),
        ("FLE Standard Time", "EE", "Europe/Tallinn", True),
        ("FLE Standard Time", "", "Europe/Kiev", False),
        ("W. Europe Standard Time", "DE", "Europe/Berlin", True),
        ("W. Europe Standard Time", "SE", "Europe/Stockholm", True),
        ("Tokyo Standard Time", "", "Asia/Tokyo", True),
        ("UTC", "FI", "Etc/UTC", False),
        ("A Zone Of Tomorrow", "FI", "UTC", False),
        ("", "", "UTC", False),
    ],
)
def test_windows_own_name_and_the_region(machine, key, country, found, is_certain):
    zone = machine.zone(windows=WindowsZone(key, country))
    assert (zone.name, zone.is_certain) == (found, is_certain)


def test_a_windows_that_does_not_follow_summer_time_is_asked_about(machine):
    assert not machine.zone(windows=WindowsZone("FLE Standard Time", "FI", keeps_standard_time=True)).is_certain


def test_there_is_no_registry_elsewhere():
    assert read_registry() is None


# ---------------------------------------------------------------------- the first start, and zones that are not known
class Tablet:
    def __init__(self, path: Path) -> None:
        self.path, self.clock, self.zone = path, VirtualClock(NOW), TabletZone("Europe/Helsinki", LOCALTIME, True)

    def start(self) -> Container:
        db = Database.open(self.path / "a.db", clock=self.clock, threaded=False, durable=False)
        self.container = Container(db, self.clock, find_zone=lambda: self.zone)
        self.container.first_start()
        return self.container

    def codes(self) -> list[str]:
        return [alarm.code for alarm in self.container.alarms.open() if alarm.cleared_at is None]

    def plan(self, zone: str) -> Schedule:
        c = self.container
        robot = c.catalogue.save_robot(Robot("R1", "10.0.0.1", "u"), password="p")
        mission = c.catalogue.save_mission(Mission("Go", "g"))
        saved = c.catalogue.save_schedule(
            Schedule("S", robot.id, mission.id, datetime(2026, 11, 23, 9), "Asia/Tokyo", "FREQ=DAILY")
        )
        c.db.write(lambda c: c.execute("UPDATE schedules SET timezone = ?", (zone,)))
        return saved

    def planned(self) -> tuple[str, bool, datetime | None]:
        [schedule] = self.container.repositories.schedules.all(self.container.db.read())
        return schedule.timezone, schedule.enabled, schedule.next_at

    def lose_zone(self) -> None:
        self.container.db.write(lambda c: self.container.repositories.settings.save(c, timezone="Mars/Base"))
        self.container.close()


@pytest.fixture
def tablet(tmp_path):
    tablet = Tablet(tmp_path)
    yield tablet
    tablet.container.close()


GUESS = TabletZone("Europe/Helsinki", LOCALTIME, False)


def test_a_certain_zone_is_taken_without_a_word(tablet):
    assert tablet.start().settings().timezone == "Europe/Helsinki"
    assert tablet.codes() == []


def test_a_guess_is_taken_and_alarmed_until_somebody_chooses(tablet, caplog):
    tablet.zone = GUESS
    assert tablet.start().settings().timezone == "Europe/Helsinki"
    assert tablet.codes() == ["zone_guessed"]
    assert len([record for record in caplog.records if "not certain which time zone" in record.message]) == 1
    tablet.container.close()
    assert "zone_guessed" in [alarm.code for alarm in tablet.start().alarms.open()]
    tablet.container.catalogue.change_settings(poll_interval_seconds=20)
    assert tablet.codes() == ["zone_guessed"]
    tablet.container.catalogue.change_settings(timezone="Europe/Helsinki")
    assert tablet.container.alarms.open() == []


@pytest.mark.parametrize("zone", [GUESS.name, "Europe/Riga"])
def test_a_configuration_with_a_zone_is_a_choice(tablet, zone):
    tablet.zone = GUESS
    tablet.start()
    import_file(tablet.container.catalogue, settings={"timezone": zone})
    assert tablet.container.settings().timezone == zone
    assert tablet.codes() == []


def test_an_unknown_zone_of_the_settings_gives_way_to_the_tablets(tablet, caplog):
    tablet.start()
    tablet.plan("Mars/Base")
    tablet.lose_zone()
    assert tablet.start().settings().timezone == "Europe/Helsinki"
    assert tablet.planned() == ("Europe/Helsinki", True, datetime(2026, 11, 23, 7, tzinfo=UTC))
    assert [message for message in caplog.messages if "Mars/Base" in message] == [
        f"At the start the time zone Mars/Base is not known here; {what} Europe/Helsinki"
        for what in ("the settings take", "the schedule S takes")
    ]


def test_nothing_starts_by_a_guess_in_place_of_an_unknown_zone(tablet):
    tablet.start()
    tablet.plan("Mars/Base")
    tablet.lose_zone()
    tablet.zone = TabletZone("UTC", "", False)
    tablet.start()
    assert tablet.planned() == ("UTC", False, None)
    assert "zone_guessed" in tablet.codes()
    [alarm] = [alarm for alarm in tablet.container.alarms.open() if alarm.code == "zone_unknown"]
    assert alarm.details == {"schedule": "S", "zone": "Mars/Base"}
