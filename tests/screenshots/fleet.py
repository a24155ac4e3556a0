"""All robots: a dozen, fifty and two hundred, with something abnormal and all well; an outage, a filter, the wall view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from app.screens.common.robot_groups import Group
from app.screens.frame.facts import OpenIssues
from app.screens.home.facts import HomeFacts
from app.screens.home.fleet_model import FleetViewModel
from app.screens.home.wall import LEFT_ALONE
from tests.screenshots.home import home
from tests.screenshots.registry import BOTH, GLOVES, LANDSCAPE, LARGE_TEXT, SHARP, SMALL, SMALL_LARGE_TEXT, picture
from tests.support import fleet_facts as sample
from tests.support import home_facts as home_sample

EVERY_SIZE = (*BOTH, SMALL, SHARP, LARGE_TEXT, SMALL_LARGE_TEXT, GLOVES)


class _AtOnce:
    """Background work that is done when it is asked for."""

    def run(
        self,
        work: Callable[[], Any],
        done: Callable[[Any], object],
        *_args: object,
        key: object = None,
        apart: str = "",
    ) -> None:
        if not apart and key is None:
            done(work())


def fleet(studio: Any, facts: HomeFacts, *, issues: OpenIssues | None = None) -> FleetViewModel:
    """``issues``: those that the app would have of these robots."""
    answers = dict.fromkeys(("catalogue", "engine", "history", "robot_states", "alarms"), sample.Answers())
    screen = home(studio, facts, issues=issues, background=_AtOnce(), more=answers)
    page: FleetViewModel = screen.vm.fleet
    page.open()
    studio.afterwards(page.close)
    studio.driver.advance(0.5)
    return page


@picture("fleet-twelve", sizes=EVERY_SIZE)
def twelve(studio: Any) -> None:
    fleet(studio, sample.facts(12))


@picture("fleet-twelve-well", sizes=BOTH)
def twelve_well(studio: Any) -> None:
    fleet(studio, sample.facts(12, well=True))


@picture("fleet-fifty", sizes=EVERY_SIZE)
def fifty(studio: Any) -> None:
    fleet(studio, sample.facts(50))


@picture("fleet-fifty-well", sizes=EVERY_SIZE)
def fifty_well(studio: Any) -> None:
    fleet(studio, sample.facts(50, well=True))


@picture("fleet-200", sizes=EVERY_SIZE)
def two_hundred(studio: Any) -> None:
    fleet(studio, replace(sample.facts(200), groups=sample.halls(200)))


STATES = (home_sample.READY, home_sample.EXECUTING, home_sample.CHARGING, home_sample.READY, home_sample.FAILED)


@picture("fleet-any", sizes=(*BOTH, SMALL, LARGE_TEXT))
def any_robot(studio: Any) -> None:
    """Robots of a fleet, and any of them."""
    fleet(studio, sample.of_fleet(*STATES))


@picture("fleet-silent", sizes=(*BOTH, SMALL, LARGE_TEXT))
def silent_fleet(studio: Any) -> None:
    fleet(studio, sample.of_fleet(*STATES, silent=True))


@picture("home-any", sizes=(*BOTH, SMALL, LARGE_TEXT))
def home_of_any(studio: Any) -> None:
    home(studio, sample.with_any_run())


@picture("home-fleet-silent", sizes=(*BOTH, SMALL, LARGE_TEXT))
def home_of_silent_fleet(studio: Any) -> None:
    home(studio, sample.of_fleet(*STATES[:2], silent=True))


@picture("fleet-outage", sizes=(*BOTH, SMALL))
def outage(studio: Any) -> None:
    fleet(studio, sample.outage(50))


@picture("fleet-outage-opened", sizes=(*BOTH, SMALL))
def outage_opened(studio: Any) -> None:
    page = fleet(studio, sample.outage(50))
    page.act(page.pane.rows[4].key, "open")


@picture("fleet-filter", sizes=BOTH)
def filtered(studio: Any) -> None:
    fleet(studio, sample.facts(50)).show_only(Group.CHARGING)


@picture("fleet-search", sizes=(*BOTH, SMALL))
def searched(studio: Any) -> None:
    page = fleet(studio, sample.facts(50))
    page.show_only("search")
    page.query = "rob"


@picture("fleet-waiting", sizes=(LANDSCAPE,))
def waiting(studio: Any) -> None:
    fleet(studio, replace(sample.facts(8), open=home_sample.WITH_WAITING.open, groups=home_sample.WITH_WAITING.groups))


@picture("fleet-wall", sizes=(*BOTH, SMALL))
def wall(studio: Any) -> None:
    page = fleet(studio, sample.facts(50))
    page.wall.is_kiosk = True
    studio.driver.skip(LEFT_ALONE + 1)
    studio.afterwards(page.wall.leave)


@picture("fleet-one-robot", sizes=(*BOTH, SMALL))
def one(studio: Any) -> None:
    fleet(studio, sample.facts(50)).leave()
