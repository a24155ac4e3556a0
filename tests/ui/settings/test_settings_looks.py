"""What the design of Settings promises, counted from the widgets."""

from __future__ import annotations

import pytest

from app.mir.errors import AnotherRobot
from app.screens.settings.missions import MissionSheet
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.trust import TrustSheet
from app.screens.settings.trust_view import another_robot, certificate
from app.widgets.frame import Frame
from tests.screenshots import fleets
from tests.screenshots.check_up import Checked, found
from tests.screenshots.settings import Plant, with_groups
from tests.ui import checks, looks
from tests.ui.window_sizes import window

WIDE, LOW, TALL = (1280, 800), (1024, 600), (800, 1280)
SHOWN = ((WIDE, 1.0, "en"), (LOW, 1.0, "en"), (TALL, 1.0, "en"), (WIDE, 1.3, "fi"), (LOW, 1.0, "fi"))
MOST_WORDS, WITH_SHEET, CHECK_UP = 80, 90, 100


@pytest.fixture(
    params=SHOWN,
    ids="{0[0][0]}x{0[0][1]}-{0[1]}-{0[2]}".format,
)
def rig(request, ui):
    size, scale, language = request.param
    with window(ui, size, scale, language) as rig:
        rig.is_wide = size == WIDE
        yield rig


def keeps_to_it(part) -> None:
    assert looks.scrolls(part) == []
    assert looks.targets(part) == []
    assert len(looks.filled(part)) <= 1
    assert "\n".join(checks.problems(part)) == ""


@pytest.mark.parametrize(
    "section", ["setup", "robots", "missions", "constraints", "idle", "scheduler", "display", "data", "about"]
)
def test_a_section_keeps_to_what_the_design_allows(rig, ui, section):
    with_groups(Plant(rig)).screen(rig, section)
    frame = ui.find(Frame)
    keeps_to_it(frame)
    assert looks.sizes(frame) <= looks.SIZES
    if rig.is_wide:
        assert len(looks.words(frame)) <= MOST_WORDS


def robot(screen):
    return RobotSheet(screen.vm.context, screen.vm.context.facts.robots[0])


def mission(screen):
    return MissionSheet(screen.vm.context, screen.vm.context.facts.missions[0])


def another(screen):
    problem = AnotherRobot(address="10.40.12.21", expected="201806001234", found="202106004471")
    question = another_robot(screen.vm.context.facts.robots[0], problem, has_password=False)
    return TrustSheet(question, lambda: None)


def fingerprints(screen):
    return TrustSheet(certificate("Aino", "3fa1c2" * 11, "77de01" * 11), lambda: None)


@pytest.mark.parametrize("build", [robot, mission, fingerprints, another])
def test_a_sheet_keeps_to_it_too(rig, ui, build):
    screen = Plant(rig).screen(rig, "robots")
    frame, sheet = ui.find(Frame), build(screen)
    rig.afterwards(screen.vm.context.shell.sheets.give_up)
    screen.vm.context.shell.sheets.show(sheet)
    ui.advance(0.3)
    keeps_to_it(sheet)
    if rig.is_wide and build is not fingerprints:
        assert len(looks.words(frame)) + len(looks.words(sheet)) <= WITH_SHEET


def place(screen):
    screen.page.places.act(screen.page.context.facts.places[0].id, "open")


def new_place(screen):
    screen.page.places.add()


def idle_rule(screen):
    screen.page.act(screen.page.context.facts.robots[0].id, "open")


def days(screen):
    screen.page.calendar.add()


def export(screen):
    screen.page.export_configuration()


def restore(screen):
    screen.page.restore()


@pytest.mark.parametrize(
    ("section", "build"),
    [
        ("missions", place),
        ("idle", idle_rule),
        ("constraints", days),
        ("data", export),
        ("missions", new_place),
        ("data", restore),
    ],
)
def test_a_sheet_that_its_page_opens_keeps_to_it_too(rig, ui, section, build):
    plant = with_groups(Plant(rig))
    screen = plant.screen(rig, section)
    rig.afterwards(plant.shell.sheets.give_up)
    build(screen)
    ui.wait(lambda: plant.shell.background.idle)
    ui.advance(0.3)
    sheet = plant.shell.sheets.top
    keeps_to_it(sheet)
    if rig.is_wide:
        assert len(looks.words(ui.find(Frame))) + len(looks.words(sheet)) <= WITH_SHEET


@pytest.mark.parametrize("show", [fleets.fleet, fleets.new_enterprise, fleets.robots_of_it, fleets.robot])
def test_the_sheets_of_a_fleet_and_its_robots_keep_to_it_too(rig, ui, show):
    screen = fleets.opened(rig, show)
    sheet = screen.vm.context.shell.sheets.top
    keeps_to_it(sheet)
    if rig.is_wide:
        assert len(looks.words(ui.find(Frame))) + len(looks.words(sheet)) <= WITH_SHEET


@pytest.mark.parametrize("kind", ["good", "odd"])
def test_a_check_up_keeps_to_it_too(rig, ui, kind):
    plant = Checked(rig, Sisu=found(kind))
    check_up = plant.opened(rig, "Sisu")
    plant.settle(rig)
    sheet = plant.shell.sheets.top
    keeps_to_it(sheet)
    assert check_up.found
    if rig.is_wide and kind == "good":  # with a dozen notes all rows are sentences
        assert len(looks.words(sheet)) <= CHECK_UP
