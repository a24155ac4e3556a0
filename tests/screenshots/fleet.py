"""All robots: a dozen and fifty, with something abnormal and all well; a filter, and one that finds nothing any more."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from app.screens.common.robot_groups import Group
from app.screens.frame.facts import OpenIssues
from app.screens.home.fleet_model import FleetViewModel
from tests.screenshots.home import home
from tests.screenshots.registry import BOTH, GLOVES, LANDSCAPE, LARGE_TEXT, SHARP, SMALL, SMALL_LARGE_TEXT, picture
from tests.support import fleet_facts as sample

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


def fleet(studio: Any, count: int, *, well: bool = False, issues: OpenIssues | None = None) -> FleetViewModel:
    """``issues``: those that the app would have of these robots."""
    answers = sample.Answers()
    screen = home(
        studio,
        sample.facts(count, well=well),
        issues=issues,
        background=_AtOnce(),
        more=dict.fromkeys(("catalogue", "history", "robot_missions"), answers),
    )
    page: FleetViewModel = screen.vm.fleet
    page.open()
    studio.afterwards(page.close)
    studio.driver.advance(0.5)
    return page


@picture("fleet-twelve", sizes=EVERY_SIZE)
def twelve(studio: Any) -> None:
    fleet(studio, 12)


@picture("fleet-twelve-well", sizes=BOTH)
def twelve_well(studio: Any) -> None:
    fleet(studio, 12, well=True)


@picture("fleet-twenty-four", sizes=(LANDSCAPE,))
def twenty_four(studio: Any) -> None:
    fleet(studio, 24)


@picture("fleet-fifty", sizes=EVERY_SIZE)
def fifty(studio: Any) -> None:
    fleet(studio, 50)


@picture("fleet-fifty-well", sizes=BOTH)
def fifty_well(studio: Any) -> None:
    fleet(studio, 50, well=True)


@picture("fleet-first", sizes=(LANDSCAPE,))
def needy_first(studio: Any) -> None:
    fleet(studio, 50).sort()


@picture("fleet-filter", sizes=BOTH)
def filtered(studio: Any) -> None:
    fleet(studio, 50).show_only(Group.SILENT)


@picture("fleet-filter-empty", sizes=(LANDSCAPE,))
def filtered_empty(studio: Any) -> None:
    fleet(studio, 12, well=True).show_only(Group.STOPPED)


@picture("fleet-one-robot", sizes=(*BOTH, SMALL))
def one(studio: Any) -> None:
    fleet(studio, 50).leave()
