"""Settings, every section and dialog: the plant of the visual target, a Friday afternoon."""

from __future__ import annotations

import os
from dataclasses import replace
from datetime import UTC, datetime, timedelta

from app.container import Container
from app.database.backups import back_up
from app.database.connection import Database
from app.database.missions import StopRepository
from app.domain.message import message
from app.domain.models import Connection, Group, HandOver, Mission, Place, Robot, Schedule
from app.domain.robot import IdentifiedBy, Identity, MissionInfo, RobotState, RobotStatus, Stop
from app.i18n import _
from app.mir.errors import AnotherRobot, Unauthorized
from app.screens.common.shell import Shell, pick
from app.screens.common.view_model import Background, Navigator, Snackbars, UiBus
from app.screens.settings.data import ImportSheet
from app.screens.settings.find import FindSheet
from app.screens.settings.missions import MissionSheet
from app.screens.settings.missions_view import offer_options, offers
from app.screens.settings.page import PageContext
from app.screens.settings.removals import robot_question
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.screen import SettingsScreen, SettingsViewModel
from app.screens.settings.trust import TrustSheet
from app.screens.settings.trust_view import another_robot, certificate
from app.screens.settings.view import done
from app.services.catalogue.configuration.importing import DeletesRuns
from app.services.files import places
from app.services.robots import finder
from app.widgets.choices import ChoiceSheet
from app.widgets.sheet import AskSheet
from tests.screenshots.frame import framed
from tests.screenshots.registry import BOTH, GLOVES, LARGE_TEXT, PORTRAIT, SMALL, picture
from tests.support.clock import VirtualClock

EVERY_SIZE = (*BOTH, SMALL, LARGE_TEXT, GLOVES)
HOME = "/home/operator"
NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
ROBOTS = (
    ("Aino", "10.40.12.21", "MiR250", "200104012", "3.5.4", Connection.CONNECTED, 2),
    ("Veikko", "10.40.12.22", "MiR100", "180003127", "2.13.4", Connection.CONNECTED, 2),
    ("Sisu", "10.40.12.23", "MiR1350", "220511008", "3.5.4", Connection.SLOW, 9),
)
MISSIONS = (
    "Deliver kits to line 2",
    "Collect empties",
    "Return to charger",
    "Bring pallet to dock",
    "Waste to compactor",
    "Move coils to press",
    "Night stock count",
    "Floor wash, hall A",
    "Charge",
)
PLAN = (
    ("Aino", "Deliver kits to line 2"),
    ("Aino", "Collect empties"),
    ("Aino", "Night stock count"),
    ("Veikko", "Collect empties"),
    ("Veikko", "Waste to compactor"),
    ("Veikko", "Floor wash, hall A"),
    ("Sisu", "Move coils to press"),
)

AT_LINE = ("Deliver kits to line 2", "Collect empties", "Waste to compactor")  # missions that drive to it


def guid(name: str) -> str:
    return f"3d7c7c{MISSIONS.index(name):02d}-ce85-11ef-904a-000e8e9884eb"


class Plant:
    """Services on a throw-away database, a window of nothing but Settings, and no robot behind the addresses."""

    def __init__(self, studio, furnished: bool = True) -> None:
        directory = studio.directory()
        table, places.MOUNTS = places.MOUNTS, directory / "mounts"  # any that this machine has
        studio.afterwards(lambda: setattr(places, "MOUNTS", table))
        places.MOUNTS.write_text(
            "/dev/sdb1 /media/operator/KINGSTON vfat rw 0 0\n//plant/plans /mnt/plans cifs rw 0 0\n", encoding="utf-8"
        )
        self.clock = VirtualClock(NOW)
        self.container = Container(
            Database.open(directory / "amr-scheduler.db", clock=self.clock, durable=False), self.clock
        )
        bus = UiBus()
        background = Background(bus)
        self.shell = Shell(Navigator(None, {}), studio.dialogs, Snackbars(), bus, background, lambda _path: None)
        for close in (self.container.close, background.close):  # the last one first
            studio.afterwards(close)
        self.container.catalogue.change_settings(timezone="Europe/Helsinki")
        if furnished:
            self._furnish()

    def _furnish(self) -> None:
        catalogue = self.container.catalogue
        catalogue.change_settings(minimum_battery_percent=30)
        for name in MISSIONS:
            catalogue.save_mission(Mission(name, guid(name), favourite=name == MISSIONS[0]))
        missions = {
            mission.name: mission for mission in self.container.repositories.missions.all(self.container.db.read())
        }
        for name, address, model, serial, software, connection, age in ROBOTS:
            user, password = ("distributor", "distributor") if name == "Veikko" else ("scheduler", "secret")
            identified_by = IdentifiedBy.ADDRESS if name == "Sisu" else IdentifiedBy.SERIAL_NUMBER
            robot = catalogue.save_robot(
                Robot(
                    name,
                    address,
                    user,
                    serial_number=serial,
                    model=model,
                    software=software,
                    identified_by=identified_by,
                ),
                password,
            )
            self.container.snapshots.update(
                robot.id,
                connection=connection,
                status=RobotStatus(RobotState.READY),
                read_at=NOW - timedelta(seconds=age),
            )
        robots = {robot.name: robot for robot in self.container.repositories.robots.all(self.container.db.read())}
        for robot, mission in PLAN:
            catalogue.save_schedule(
                Schedule(
                    "",
                    robots[robot].id,
                    missions[mission].id,
                    datetime(2026, 11, 23, 6, 30),
                    "Europe/Helsinki",
                    "FREQ=DAILY",
                )
            )
        catalogue.change_idle_rule(robots["Aino"].id, mission_id=missions["Return to charger"].id, after_minutes=15)
        catalogue.change_idle_rule(
            robots["Veikko"].id, mission_id=missions["Collect empties"].id, after_minutes=10, enabled=False
        )
        backup = self.container.db.path.parent / "backups" / "daily-2026-11-20.db"
        back_up(self.container.db.path, backup)
        os.utime(backup, (datetime(2026, 11, 20, tzinfo=UTC).timestamp(),) * 2)

    def screen(self, studio, section: str = "robots", **intent) -> SettingsScreen:
        screen = SettingsScreen(SettingsViewModel(pick(SettingsScreen.Services, self.container), self.shell))
        studio.afterwards(screen.hidden)
        names = {
            robot.id: {guid(name): name for name in MISSIONS if robot.name != "Sisu" or name != "Move coils to press"}
            for robot in self.container.repositories.robots.all(self.container.db.read())
        }
        self.container.robot_missions.names = lambda robot_id: names.get(robot_id, {})
        self.container.robot_missions.learn_names = lambda robot_id: False
        frame = framed("settings")
        frame.add_widget(screen)
        studio.show(frame)
        screen.shown(section=section, **intent)
        studio.driver.wait(lambda: self.shell.background.idle and not screen.vm._waiting)
        if section == "about":
            screen.page.directory = f"{HOME}/.local/share/amr-scheduler"
        studio.driver.advance(0.2)
        return screen


def section(name: str) -> None:
    @picture(f"settings-{name}", sizes=EVERY_SIZE)
    def build(studio):
        return Plant(studio).screen(studio, name)


for _name in ("setup", "robots", "missions", "constraints", "idle", "scheduler", "display", "data", "about"):
    section(_name)


def with_groups(plant: Plant) -> Plant:
    """Two groups, the second without a mission on one robot, a place, and a position that may become one."""
    catalogue = plant.container.catalogue
    robots = {robot.name: robot.id for robot in catalogue.robots()}
    missions = {mission.name: mission.id for mission in catalogue.missions()}
    hall = catalogue.save_group(Group("Hall 1", tuple(robots.values())))
    catalogue.save_group(Group("Small ones", (robots["Aino"], robots["Veikko"]), HandOver.AT_ONCE))
    for name, at in (("Shift bus", 6), ("Kits in the afternoon", 14)):
        catalogue.save_schedule(
            Schedule(
                name,
                None,
                missions["Deliver kits to line 2"],
                datetime(2026, 11, 23, at, 30),
                "Europe/Helsinki",
                "FREQ=DAILY",
                group_id=hall.id,
            )
        )
    catalogue.save_place(Place("Dock 2", 3, (missions["Bring pallet to dock"], missions["Collect empties"])))
    line = Stop("line-1", "Line 1")
    plant.container.db.write(lambda c: StopRepository().keep(c, {guid(name): [line] for name in AT_LINE}))
    return plant


@picture("settings-groups", sizes=EVERY_SIZE)
def groups(studio):
    screen = with_groups(Plant(studio)).screen(studio)
    screen.choose_tab("groups")
    studio.driver.advance(0.2)
    return screen


@picture("settings-places", sizes=EVERY_SIZE)
def shared_places(studio):
    screen = with_groups(Plant(studio)).screen(studio, "missions")
    screen.choose_tab("places")
    studio.driver.advance(0.2)
    return screen


def _group_sheet(name: str, show):
    @picture(f"settings-{name}", sizes=EVERY_SIZE)
    def build(studio):
        plant = with_groups(Plant(studio))
        screen = plant.screen(studio)
        screen.choose_tab("groups")
        show(plant, screen)
        studio.driver.advance(0.2)
        return screen


_group_sheet("group-sheet", lambda plant, screen: screen.page.open(plant.container.catalogue.groups()[0].id))


@picture("settings-place-sheet", sizes=EVERY_SIZE)
def place_sheet(studio):
    screen = with_groups(Plant(studio)).screen(studio, "missions")
    screen.choose_tab("places")
    screen.page.places.act(screen.page.context.facts.places[0].id, "open")
    studio.driver.advance(0.2)
    return screen


@picture("settings-list", sizes=(PORTRAIT,))
def section_list(studio):
    screen = Plant(studio).screen(studio)
    screen.go_back()
    studio.driver.advance()
    return screen


@picture("settings-empty")
def empty(studio):
    return Plant(studio, furnished=False).screen(studio)


@picture("settings-empty-missions")
def empty_missions(studio):
    return Plant(studio, furnished=False).screen(studio, "missions")


# ---------------------------------------------------------------------- what a press brings
def identity(
    serial: str = "180003127", name: str = "Veikko", model: str = "MiR100", software: str = "2.13.4"
) -> Identity:
    return Identity(
        RobotStatus(robot_name=name, robot_model=model, serial_number=serial, elapsed_s=0.038), "scheduler", software
    )


@picture("settings-data-done")
def data_done(studio):
    screen = Plant(studio).screen(studio, "data")
    screen.page.vm.outcome = done(_("Log written"), f"{HOME}/Documents/amr-scheduler-log-2026-11-20.csv")
    return screen


def _file_sheet(name: str, action: str):
    @picture(f"settings-data-{name}", sizes=EVERY_SIZE)
    def build(studio):
        plant = Plant(studio)
        screen = plant.screen(studio, "data")
        screen.page.act("", action)
        studio.driver.wait(lambda: plant.shell.background.idle and plant.shell.sheets.top.items)
        studio.driver.advance(0.2)
        return screen


_file_sheet("export", "export")
_file_sheet("restore", "restore")


@picture("settings-display-pin", sizes=EVERY_SIZE)
def display_pin(studio):
    plant = Plant(studio)
    plant.container.access.set_pin("4711")
    return plant.screen(studio, "display")


def dialog(name: str):
    """A picture of what ``build(context)`` opens over Settings."""

    def register(build):
        @picture(name, sizes=EVERY_SIZE)
        def shown(studio):
            screen = Plant(studio).screen(studio, "missions" if "mission" in name else "robots")
            built = build(screen.vm.context)
            studio.afterwards(screen.vm.context.shell.sheets.give_up)
            screen.vm.context.shell.sheets.show(built)
            return screen

        return shown

    return register


@dialog("import-changes")
def import_changes(context: PageContext):
    lines = [
        message("robot {name} added", name="Helmi"),
        message(
            "robot {name} changed: {what}. It is switched off and needs a password",
            name="Aino",
            what="Address 10.40.12.21 → 10.40.12.31",
        ),
        message("mission {name} added", name="Deliver kits"),
    ]
    return ImportSheet(found=(lines, DeletesRuns(1000, 240)))


@dialog("robot-sheet-new")
def robot_dialog_new(context: PageContext):
    return RobotSheet(context)


@dialog("robot-sheet")
def robot_dialog(context: PageContext):
    dialog = RobotSheet(context, context.facts.robots[0])
    dialog._passed(identity("200104012", "Aino", "MiR250", "3.5.4"))
    return dialog


@dialog("robot-dialog-new-robot")
def robot_another_answers(context: PageContext):
    problem = AnotherRobot(address="10.40.12.21", expected="201806001234", found="202106004471")
    question = another_robot(context.facts.robots[0], problem, has_password=False)
    return TrustSheet(question, lambda: None)


@dialog("robot-dialog-delete")
def robot_dialog_delete(context: PageContext):
    robot = context.facts.robots[0]
    return AskSheet(
        title=_("Delete {name}?").format(name=robot.name),
        text=robot_question(context.facts, robot),
        foot=_("Keep"),
        second=_("Delete"),
        closable=False,
    )


@dialog("robot-dialog-certificate")
def robot_certificate(context: PageContext):
    question = certificate("Aino", "3fa1c2" * 10 + "90ab", "3fa1c2" * 9 + "77de01" + "1234")
    return TrustSheet(question, lambda: None)


@dialog("robots-found")
def robots_found(context: PageContext):
    addresses, finder.addresses = finder.addresses, list  # no network is asked
    sheet = FindSheet(context, lambda _address, _name: None)
    finder.addresses = addresses
    sheet._answers = {
        f"10.40.12.{n}": RobotStatus(robot_name=name, robot_model=model)
        for n, name, model in ((21, "Aino", "MiR250"), (34, "MiR_R1187", "MiR600"), (35, "Helmi", "MiR250"))
    }
    sheet._end()
    return sheet


@dialog("robot-sheet-problems")
def robot_dialog_problems(context: PageContext):
    dialog = RobotSheet(context)
    dialog.enter(name="Aino", address="https://10.40.12.29", username="scheduler")
    dialog.password = "wrong"
    dialog._failed(Unauthorized(address="10.40.12.29"))
    dialog.problems["name"] = "There is a robot Aino already"
    return dialog


@dialog("mission-dialog")
def mission_dialog(context: PageContext):
    return MissionSheet(context, replace(context.facts.missions[0], usual_minutes=25))


@dialog("mission-checklist")
def mission_checklist(context: PageContext):
    found = [
        MissionInfo(f"new-{name}", name)
        for name in ("Cart to press", "Deliver kits to line 3", "Empty cart home", "Charge")
    ]
    offered = offers(found, context.facts.missions, context.facts.robots[0].id)
    return ChoiceSheet(
        title=_("Missions of {robot}").format(robot="Aino"),
        options=offer_options(offered),
        selected=["new-Cart to press"],
        multiple=True,
        confirm=_("Add chosen"),
    )
