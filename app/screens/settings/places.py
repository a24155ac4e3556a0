"""Settings, Missions, Places: locations for a limited number of this app's missions at a time."""

from __future__ import annotations

from typing import Any
from zoneinfo import ZoneInfo

from kivy.event import EventDispatcher
from kivy.properties import ListProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain import conflicts
from app.domain.models import Place
from app.domain.names import LONGEST
from app.i18n import _
from app.screens.settings import groups_view as view
from app.screens.settings.edit_sheet import EditSheet
from app.screens.settings.page import PageContext
from app.services.catalogue.edit import Removed
from app.services.planning.planned import Conflict
from app.widgets.items import Option

USUAL_MOST = 1  # as the word says; its help explains larger numbers


class PlacesPart(EventDispatcher):
    """The rows of the places, and what is pressed there."""

    items = ListProperty()

    def __init__(self, context: PageContext) -> None:
        super().__init__()
        self._context = context

    def show(self) -> None:
        facts, sheet = self._context.facts, self._context.shell.sheets.top
        chosen = sheet.stored_id if isinstance(sheet, PlaceSheet) else None
        self.items = view.place_items(facts, chosen)

    # ------------------------------------------------------------------ what is pressed
    def act(self, key: int | str, action: str, *_values: Any) -> None:
        """On the row of a place (key: its id), or of a position that is proposed (its guid)."""
        if isinstance(key, str):
            self._answer(key, action)
        elif place := self._context.facts.place(key):
            self._open(place)

    def add(self) -> None:
        self._open(Place("", USUAL_MOST))

    def explain(self, button: Widget) -> None:
        words = _(
            "A start that needs a full place waits. Robots avoid collisions themselves: this only prevents queues. "
            "With 1, a place is empty while the next robot drives up. 2 or 3 keep it in use."
        )
        self._context.shell.dialogs.explain(button, _("Robots at a time"), words)

    def _answer(self, position: str, action: str) -> None:
        """To what is proposed."""
        context = self._context
        proposed = next((place for place in context.facts.proposed if place.position == position), None)
        if proposed is None:
            return
        if action == "decline":
            context.change(lambda: context.services.proposed_places.decline(position))
        else:
            self._open(Place(proposed.name[:LONGEST], USUAL_MOST, proposed.missions))

    def _open(self, place: Place) -> None:
        self._context.shell.sheets.show(PlaceSheet(self._context, place))
        self.show()


class PlaceSheet(EditSheet):
    """A place and the missions that use it."""

    kind = "places"
    at_once = ("name", "most", "missions")
    fields = ("name",)

    missions = StringProperty()
    warning = StringProperty()  # that it will be wanted too much

    def delete(self, it: Place) -> Removed:
        return self.context.services.catalogue.remove_place(it.id)

    def on_it(self, *_args: Any) -> None:
        place, facts, plan = self.it, self.context.facts, self.context.services.plan
        self.missions = view.missions_phrase(facts, place.missions)

        def found(conflict: Conflict | None) -> None:
            zone = ZoneInfo(facts.settings.timezone)
            self.warning = conflicts.sentence(conflict.code, conflict.at, conflict.details, zone, _) if conflict else ""

        self.context.run(lambda: plan.place_warning(place), found, lambda _problem: None, key="place warning")

    # ------------------------------------------------------------------ what is changed
    def pick_missions(self) -> None:
        facts = self.context.facts
        options = [
            Option(
                mission.id,
                mission.name,
                "flag-outline",
                _("Only {robot}").format(robot=robot.name) if (robot := facts.robot(mission.robot_id)) else "",
            )
            for mission in facts.missions
        ]
        self.context.shell.dialogs.choose_many(
            _("Missions that use it"),
            options,
            _("Set"),
            lambda keys: self.choose(missions=tuple(keys)),
            selected=self.it.missions,
        )
