"""Settings, a fleet with one of its robots in the plan, and the sheets of both."""

from __future__ import annotations

from dataclasses import replace

from app.database.fleets import FleetRepository
from app.domain.check_up import RobotProfile
from app.domain.models import ANY_VEHICLE, Fleet, FleetKind, Robot
from app.domain.robot import Vehicle
from app.screens.settings.fleet_sheet import FleetSheet
from app.services.robots.fleets import FoundVehicle
from tests.screenshots.registry import picture
from tests.screenshots.settings import EVERY_SIZE, Plant

MODEL = "MiR250"
VEHICLES = [
    Vehicle(ANY_VEHICLE, "Hall 2"),
    Vehicle("7", "MiR 7", "202106004471", MODEL, "10.40.13.7"),
    Vehicle("8", "MiR 8", "202106004502", MODEL, "10.40.13.8"),
    Vehicle("9", "MiR 9", "202106004519", MODEL, "10.40.13.9"),
]


def with_fleet(plant: Plant) -> Plant:
    """One that was checked up. It has three robots: one is also reached directly."""
    catalogue, db = plant.container.catalogue, plant.container.db
    fleet = catalogue.save_fleet(Fleet("Hall 2", "10.40.12.5", username="distributor"), password="distributor")
    fleet = replace(fleet, identity="hall-2", software="3.5.4", profile=RobotProfile("hall-2", "3.5.4"))
    db.write(lambda c: FleetRepository().update(c, fleet))
    twin = catalogue.robots()[0]
    robot = catalogue.save_robot(Robot("MiR 7", "", fleet=fleet, vehicle="7", model=MODEL))
    found = [FoundVehicle(vehicle) for vehicle in VEHICLES]
    found[1], found[3] = replace(found[1], robot=robot), replace(found[3], others=(twin,))
    plant.container.fleets.find = lambda _fleet_id: found
    return plant


def opened(studio, show):
    """Settings, Robots, after ``show(page, facts)`` has opened a sheet."""
    plant = with_fleet(Plant(studio))
    screen = plant.screen(studio)
    studio.afterwards(plant.shell.sheets.give_up)
    show(screen.page, screen.vm.context.facts)
    studio.driver.wait(lambda: plant.shell.background.idle)
    studio.driver.advance(0.3)
    return screen


def fleet(page, facts):
    page.open(("fleet", facts.fleets[0].id))


def new_fleet(page, _facts):
    page.open(("fleet", None))


def new_enterprise(page, facts):
    new_fleet(page, facts)
    page.context.shell.sheets.top.choose_kind(FleetKind.ENTERPRISE)


def robots_of_it(page, facts):
    page.context.shell.sheets.show(FleetSheet(page.context, facts.fleets[0]))
    page.context.shell.sheets.top.show_robots()


def check_up(page, facts):
    page.context.shell.sheets.show(FleetSheet(page.context, facts.fleets[0]))
    page.context.shell.sheets.top.check_up()
    card = page.context.shell.sheets.top.vm
    card.mission, card.vehicle = "Home", "MiR 7"
    card.choose(wants_trial=True)


def robot(page, facts):
    page.open(facts.robots_of(facts.fleets[0])[0].id)


@picture("settings-fleet", sizes=EVERY_SIZE)
def page_with_a_fleet(studio):
    return opened(studio, lambda _page, _facts: None)


for _name, _show in (
    ("fleet-sheet", fleet),
    ("fleet-sheet-new", new_fleet),
    ("fleet-sheet-enterprise", new_enterprise),
    ("fleet-robots", robots_of_it),
    ("fleet-robot-sheet", robot),
    ("fleet-check-up", check_up),
):
    picture(f"settings-{_name}", sizes=EVERY_SIZE)(lambda studio, show=_show: opened(studio, show))
