"""The sheet that adds or edits a MiR Fleet, and the one in which its robots are added to the plan."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from kivy.properties import ListProperty, StringProperty

from app.domain.models import Fleet, FleetKind, InvalidInput, Robot
from app.domain.robot import FleetIdentity, Vehicle
from app.i18n import _
from app.mir.errors import RobotError
from app.screens.common.problems import sentence_of
from app.screens.settings import fleets_view as view
from app.screens.settings import removals
from app.screens.settings.check_up import open_check_up, standing_of
from app.screens.settings.connection_sheet import ConnectionSheet
from app.screens.settings.edit_sheet import SettingsSheet
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView
from app.services.catalogue.edit import Removed
from app.services.robots.fleets import FoundVehicle
from app.widgets.items import Option


class FleetSheet(ConnectionSheet):
    """What is stored of its kind stays: a fleet of another kind is another fleet."""

    kind = "fleets"
    at_once = ("name", "enabled")
    kind_part, known_part = "FleetKinds", "FleetKnown"
    taken = "there is a fleet {name} already"

    kinds = ListProperty()

    def __init__(self, context: PageContext, fleet: Fleet | None = None) -> None:
        super().__init__(context, fleet or Fleet("", ""), kinds=list(view.kind_names().items()))

    @property
    def wanted(self) -> Mapping[str, str]:
        return {
            "name": _("Give the fleet a name"),
            "username": _("Enter the fleet's user name"),
            "asking": _("Asking the fleet …"),
        }

    def on_it(self, *args: Any) -> None:
        self.has_user = self.it.kind == FleetKind.CLASSIC
        super().on_it(*args)

    def choose_kind(self, kind: FleetKind) -> None:
        """A password is no key."""
        self.password = ""
        self.enter(kind=kind, username=self.it.username if kind == FleetKind.CLASSIC else "")

    def show_facts(self) -> None:
        super().show_facts()
        if self.stored is not None:
            self.about = view.fleet_note(self.context.facts, self.stored, standing_of(self.context, self.stored))

    # ------------------------------------------------------------------ test, save
    def ask(self) -> Callable[[], FleetIdentity]:
        fleet, password, fleets = self.entered(), self.password or None, self.context.services.fleets
        return lambda: fleets.test_connection(fleet, password)

    def found(self, said: FleetIdentity) -> NoticeView:
        return view.fleet_found(said)

    def was_added(self, saved: Fleet) -> None:
        """Without its robots it is of no use."""
        if not saved.needs_password:
            self.show_robots()

    # ------------------------------------------------------------------ menu
    def more(self) -> list[Option]:
        off = _("{robot} needs its password").format(robot=self.stored.name) if self.stored.needs_password else ""
        return [Option(self.show_robots, _("Robots of the fleet"), "robot-outline", off=off)]

    def check_up(self) -> None:
        open_check_up(self.context, self.stored)

    def show_robots(self) -> None:
        self.context.shell.sheets.show(FleetRobotsSheet(self.context, self.stored))

    def question(self) -> str:
        return removals.fleet_question(self.context.facts, self.stored)

    def delete(self, it: Fleet) -> Removed:
        services = self.context.services
        with suppress(RobotError, InvalidInput):  # then the removal says what is left there
            services.fleet_check_ups.put_back(it.id)
        return services.catalogue.remove_fleet(it.id)


class FleetRobotsSheet(SettingsSheet):
    """Asks the fleet for its robots; each can be added to the plan."""

    said = StringProperty()
    items = ListProperty()

    def __init__(self, context: PageContext, fleet: Fleet, **kwargs: Any) -> None:
        self._context, self._fleet = context, fleet
        self._found: Sequence[FoundVehicle] | None = None  # None: not known yet
        super().__init__(title=_("Robots of {fleet}").format(fleet=fleet.name), foot_style="outlined", **kwargs)
        self._search()

    def _search(self) -> None:
        fleets, fleet = self._context.services.fleets, self._fleet
        self._found, self.said, self.foot = None, _("Asking the fleet …"), ""

        def found(vehicles: Sequence[FoundVehicle]) -> None:
            self._found, self.said = vehicles, ""
            self.show_facts()

        def failed(problem: BaseException) -> None:
            self.said, self.foot = sentence_of(problem), _("Search again")

        self._context.run(lambda: fleets.find(fleet.id), found, failed, key="a fleet's robots", apart="find robots")

    def show_facts(self) -> None:
        found, robots, fleet = self._found, self._context.facts.robots, self._fleet
        if found is not None:
            self.items = view.vehicle_items(found, robots, fleet)
            self.foot = _("Add all") if len(view.to_be_added(found, robots, fleet)) > 1 else ""

    def on_done(self) -> None:
        """Search again, or add all that are shown."""
        if self._found is None:
            self._search()
        else:
            self._add(view.to_be_added(self._found, self._context.facts.robots, self._fleet))

    def choose(self, vehicle_id: str) -> None:
        found = self._found or ()
        self._add(each.vehicle for each in found if each.vehicle.id == vehicle_id)

    def _add(self, vehicles: Iterable[Vehicle]) -> None:
        context, fleet, wanted = self._context, self._fleet, list(vehicles)

        def added(robots: Sequence[Robot]) -> None:
            context.facts = replace(context.facts, robots=(*context.facts.robots, *robots))
            self.show_facts()  # nothing can be added twice
            context.refresh()
            context.say(_("{name} added").format(name=", ".join(robot.name for robot in robots)))

        context.run(lambda: context.services.fleets.add(fleet.id, wanted), added)
