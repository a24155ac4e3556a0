"""Home in small windows, with an alarm and a question of a robot that talks too much: nothing overlaps, and what matters is reached."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import date, time
from itertools import product

import pytest
from kivy.core.window import Window
from kivy.uix.label import Label

from app.domain.models import Alarm, Connection, Priority
from app.domain.robot import RobotProblem, UserPrompt, problems_in_words
from app.i18n import _
from app.screens.common.overlays import Dialogs
from app.screens.common.pin_sheet import PinSheet
from app.screens.common.sheets import Sheets
from app.screens.frame.facts import OpenIssues
from app.screens.frame.view import BannerView
from app.screens.home.cards import PlaceMap, ProblemNote, PromptOption, RobotCard, RobotFoot, TodayRow
from app.screens.home.facts import HomeFacts
from app.screens.home.fleet_page import RobotCell
from app.screens.home.screen import HomeScreen
from app.screens.home.sending import AllMissionsSheet
from app.screens.settings.missions import MissionRow
from app.widgets.buttons import CommandButton
from app.widgets.fields import Field
from app.widgets.frame import Frame
from app.widgets.list_row import ListRow
from app.widgets.month import MonthDay
from app.widgets.number_pad import PadKey
from app.widgets.pickers import TimeCell
from app.widgets.scrolling import CalmScroll
from app.widgets.text import ScreenTitle
from tests.screenshots.fleet import fleet
from tests.screenshots.home import ERROR, SILENT, damaged, home
from tests.screenshots.planning import Stand
from tests.screenshots.settings import Plant, with_groups
from tests.support import fleet_facts
from tests.support import home_facts as sample
from tests.ui import checks
from tests.ui.logbook import rows as runs_in_sight
from tests.ui.window_sizes import Rig, reach, window

WAYS = (  # the narrowest with the largest texts first
    *product(((600, 480), (800, 480)), ("large", "gloves", "plain")),
    ((1024, 600), "gloves"),
    ((1024, 600), "large"),
    ((600, 1024), "large"),
    ((1280, 800), "plain"),
)
LOUD = tuple(RobotProblem(n, f"{n} wheel motor {'x' * 100} needs service at once") for n in range(900))
ALARM = OpenIssues(
    (
        Alarm(
            "robot_error",
            "robot:1",
            Priority.HIGH,
            sample.ago(minutes=2),
            {"robot": "Aino", "problem": problems_in_words(LOUD)},
            id=1,
        ),
        *(
            Alarm("unreachable", f"robot:{n}", Priority.MEDIUM, sample.ago(minutes=9), {"robot": "Veikko"}, id=n)
            for n in range(2, 12)
        ),
    )
)
ASKING = replace(
    sample.ASKING,
    user_prompt=UserPrompt(
        "p1",
        "Is the aisle between the warehouse and production line 2 free? " * 50,
        tuple(
            f"Door {n} with a rather long name for a door of a plant, on the {side} side"
            for n, side in enumerate(("left", "right", "far"))
        ),
    ),
)


@pytest.fixture(params=[pytest.param(way, id="{0[0]}x{0[1]}-{1}".format(*way)) for way in WAYS])
def small(ui, request) -> Iterator[Rig]:
    """A window of one of these sizes, some with gloves, some with large texts."""
    size, mode = request.param
    scale, language = (1.3, "fi") if mode == "large" else (1.0, "en")  # Finnish words are the longer ones
    with window(ui, size, scale, language, gloves=mode == "gloves") as rig:
        yield rig


def loud_home(ui, rig: Rig, status=ASKING) -> HomeScreen:
    screen = home(rig, sample.with_aino(status), issues=ALARM)
    ui.advance(0.5)
    return screen


def test_nothing_overlaps(ui, small):
    loud_home(ui, small)
    assert "\n".join(checks.problems(ui.find(Frame))) == ""


def test_the_state_is_reached_and_the_button_and_its_reason_are_seen_at_once(ui, small):
    loud_home(ui, small, replace(sample.FAILED, errors=LOUD))
    view = ui.find(HomeScreen).vm
    reach(ui, next(label for label in ui.find_all(Label) if label.text == view.view.card.state))
    assert checks.is_seen(ui.find(CommandButton, text=_("Reset errors")))


@pytest.mark.parametrize(
    "status",
    [sample.EXECUTING, sample.STOPPED, sample.ASKING, sample.READY],
    ids=["working", "stopped", "asks", "ready"],
)
def test_the_robots_button_is_never_scrolled_away(ui, small, status):
    """Also below a banner."""
    home(small, sample.with_aino(status), issues=OpenIssues([ALARM.alarms[1]]))
    ui.advance(0.5)
    assert checks.is_seen(ui.find(CommandButton, ui.find(RobotFoot)))


@pytest.mark.long
def test_a_sheet_follows_the_robots_card_when_the_window_is_turned(ui):
    with window(ui, (600, 800)) as rig:
        home(rig, sample.FACTS).vm.sending.open_all()
        ui.advance(0.5)
        for Window.size in ((800, 1280), (1280, 800), (600, 800)):
            ui.advance(0.5)
            assert "\n".join(checks.problems(ui.find(Frame))) == ""
            assert ui.find(AllMissionsSheet).height > 150
            assert checks.is_seen(ui.find(CommandButton, ui.find(RobotFoot)))


@pytest.mark.long
@pytest.mark.parametrize(
    ("scale", "language", "gloves"), [(1.0, "fi", False), (1.0, "fi", True), (1.3, "en", False), (1.3, "fi", False)]
)
@pytest.mark.parametrize("size", [(700, 500), (720, 1600), (1024, 640)], ids="{0[0]}x{0[1]}".format)
def test_every_word_has_room_in_the_windows_between(ui, size, scale, language, gloves):
    with window(ui, size, scale, language, gloves=gloves) as rig:
        home(rig, sample.FACTS)
        ui.advance(0.5)
        assert "\n".join(checks.problems(ui.find(Frame))) == ""


@pytest.mark.parametrize("size", [(800, 480), (600, 480)], ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize(("scale", "language"), [(1.0, "en"), (1.3, "fi")])
def test_the_way_to_a_first_robot_can_be_reached_below_a_banner(ui, size, scale, language):
    with window(ui, size, scale, language) as rig:
        home(rig, HomeFacts(settings=sample.FACTS.settings), issues=ALARM)
        ui.advance(0.5)
        assert "\n".join(checks.problems(ui.find(Frame))) == ""
        for text in (_("No robots yet"), _("Add robot")):
            reach(ui, next(label for label in ui.find_all(Label) if label.text == text))


@pytest.mark.long
@pytest.mark.parametrize(
    ("facts", "alarm"),
    [
        pytest.param(sample.with_aino(sample.FAILED), ERROR, id="failed"),
        pytest.param(
            sample.with_aino(sample.EXECUTING, age=250, connection=Connection.UNREACHABLE), SILENT, id="silent"
        ),
    ],
)
def test_everything_about_a_robot_that_needs_a_person_is_visible_at_once(ui, facts, alarm):
    """1280×800 with an alarm: what it says, its battery, where it is or was, and its controls."""
    screen = home(Rig(ui), facts, issues=OpenIssues([alarm]))
    ui.advance(0.5)
    for part in (
        ui.find(ProblemNote),
        ui.find(text=screen.vm.view.card.battery.text),
        ui.find(PlaceMap),
        ui.find(RobotFoot),
    ):
        assert checks.is_seen(part), part
    assert ui.find(PlaceMap).height >= 150
    assert "\n".join(checks.problems(ui.find(Frame))) == ""


@pytest.mark.parametrize(("size", "scale"), [((600, 480), 1.3), ((800, 480), 1.0), ((800, 480), 1.3)])
def test_with_gloves_an_hour_brings_the_minutes_in_sight(ui, size, scale):
    with window(ui, size, scale, gloves=True):
        dialogs = Dialogs()
        dialog = dialogs.pick_time("Starts at", time(6, 30), lambda _time: None)
        ui.advance(0.3)
        assert "\n".join(checks.problems(dialog)) == ""
        dialog.choose("hour", 7)
        ui.advance(0.3)
        assert checks.is_seen(ui.find_all(TimeCell, number=55)[-1])
        dialogs.close_all()


@pytest.mark.long
def test_with_gloves_the_chosen_day_is_seen_at_once(ui):
    with window(ui, (1280, 800), gloves=True):
        dialogs, day = Dialogs(), date(2026, 11, 30)  # in the last row
        dialogs.pick_date("First day", day, lambda _day: None, today=day)
        ui.advance(0.3)
        assert checks.is_seen(ui.find(MonthDay, day=day))
        dialogs.close_all()


@pytest.mark.parametrize(
    ("size", "scale", "gloves"), [((600, 480), 1.0, False), ((600, 480), 1.3, True), ((800, 480), 1.3, False)]
)
def test_the_message_about_a_damaged_database_and_its_button_can_be_reached(ui, size, scale, gloves):
    with window(ui, size, scale, "fi", gloves=gloves) as rig:
        damaged(rig)
        ui.advance(0.3)
        page = ui.find(CalmScroll)
        button = next(button for button in ui.find_all(CommandButton) if button.style == "filled")
        assert "\n".join(checks.problems(page)) == ""
        assert checks.area(ui.find(ScreenTitle))[3] <= Window.height
        page.scroll_to(button, padding=0, animate=False)
        ui.advance(0.1)
        assert checks.is_seen(button)


@pytest.mark.parametrize(
    ("section", "part", "kind"),
    [("missions", "missions", MissionRow), ("missions", "places", ListRow), ("idle", "", ListRow)],
)
@pytest.mark.parametrize(
    ("size", "scale", "language", "gloves"),
    [((600, 480), 1.0, "en", False), ((600, 480), 1.3, "fi", True), ((800, 480), 1.0, "en", True)],
)
def test_a_list_of_settings_can_be_reached_below_its_tools_and_a_banner(
    ui, size, scale, language, gloves, section, part, kind
):
    with window(ui, size, scale, language, gloves=gloves) as rig:
        screen = with_groups(Plant(rig)).screen(rig, section)
        if part:
            screen.choose_tab(part)
        ui.find(Frame).banner = BannerView("Aino: Failed to reach its goal " * 2)
        ui.advance(0.3)
        assert "\n".join(checks.problems(ui.find(Frame))) == ""
        page = screen.ids.columns.children[0]
        page.scroll_y = 0
        ui.advance(0.1)
        first = ui.find_all(kind, page)[0]
        assert checks.visible_area(first, checks.parents(first))[3] - checks.area(page)[1] > 60
        assert "\n".join(checks.problems(ui.find(Frame))) == ""


@pytest.mark.long
def test_fields_in_one_row_are_aligned_at_the_top(ui):
    with window(ui, (1024, 600), 1.3, "fi") as rig:
        screen = Plant(rig).screen(rig, "scheduler")
        ui.advance(0.3)
        assert len(ui.find_all(Field, root=screen)) > 3
        assert "\n".join(checks.problems(screen)) == ""


@pytest.mark.long
@pytest.mark.parametrize("size", [(600, 480), (800, 480), (800, 1280), (1024, 600)], ids="{0[0]}x{0[1]}".format)
def test_the_text_of_a_run_fits_next_to_its_time(ui, size):
    with window(ui, size, 1.3, "fi") as rig:
        stand = Stand(rig, "logs")
        row = runs_in_sight(ui)[0]
        assert row.ids.row_lines.width > row.width / 3
        assert "\n".join(checks.problems(stand.screen)) == ""


@pytest.mark.long
def test_the_text_of_a_robot_is_shown_once(ui):
    note = home(Rig(ui), sample.with_aino(sample.FAILED), issues=OpenIssues([ERROR])).vm.view.card.note
    ui.advance(0.5)
    assert [label.text for label in ui.find_all(Label) if note.quote in label.text] == [note.quote]


def test_a_blocked_start_is_in_sight(ui, small):
    home(small, sample.FACTS)
    ui.advance(0.5)
    [row] = [row for row in ui.find_all(TodayRow) if row.item.meta_tone]
    assert checks.is_seen(row) or Window.height < 500
    assert "\n".join(checks.problems(ui.find(Frame))) == ""


def test_the_worst_robot_is_seen_and_some_cells_beside_it(ui, small):
    fleet(small, fleet_facts.facts(12), issues=OpenIssues())
    ui.advance(0.5)
    worst = min(ui.find_all(ListRow), key=lambda row: -row.to_window(*row.pos)[1])
    assert checks.is_seen(worst) or Window.height < 500
    assert any(checks.is_seen(cell) for cell in ui.find_all(RobotCell)) or Window.height < 500


@pytest.mark.parametrize(("scale", "gloves"), [(1.0, False), (1.0, True), (1.3, False), (1.3, True)])
def test_two_rows_of_fifty_robots_are_readable_in_a_low_window(ui, scale, gloves):
    with window(ui, (1024, 600), scale, "fi", gloves=gloves) as rig:
        fleet(rig, fleet_facts.facts(50), issues=OpenIssues())
        ui.advance(0.5)
        tops = {
            round(cell.to_window(*cell.pos)[1])
            for cell in ui.find_all(RobotCell)
            if all(checks.is_seen(label) for label in ui.find_all(Label, root=cell) if label.text)
        }
        assert len(tops) >= 2
        assert "\n".join(checks.problems(ui.find(Frame))) == ""


@pytest.mark.parametrize("small", [pytest.param(((1024, 600), "plain"), id="1024x600")], indirect=True)
def test_how_full_the_battery_is_and_when_the_mission_is_done_is_seen_at_once(ui, small):
    card = home(small, sample.FACTS).vm.view.card
    ui.advance(0.5)
    for text in (card.battery.text, card.end):
        assert checks.is_seen(ui.find(text=text, root=ui.find(RobotCard)))


def test_a_question_and_each_answer_can_be_reached(ui, small):
    view = loud_home(ui, small).vm
    answers = ui.find_all(PromptOption)
    assert len(answers) == 3
    for answer in answers:
        reach(ui, answer)
        label = next(widget for widget in answer.walk() if isinstance(widget, Label) and widget.text == answer.text)
        assert label.height <= answer.height
    assert ui.find(text=view.view.card.note.problem)  # higher than the page in the smallest windows; above it:
    reach(ui, ui.find(text=view.view.card.state))


def test_every_key_of_the_pin_is_seen_without_scrolling(ui, small):
    sheets = Sheets()
    sheet = sheets.over(PinSheet(title="Enter the PIN", problem="Wrong PIN, 4 tries left"))
    ui.advance(0.5)
    for key in ui.find_all(PadKey):
        assert checks.is_seen(key)
    assert "\n".join(checks.problems(sheet)) == ""
    sheets.close(sheet)
