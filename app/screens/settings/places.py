"""Settings, Missions, Places: locations for a limited number of this app's missions at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any
from zoneinfo import ZoneInfo

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain import conflicts
from app.domain.models import InvalidInput, Place
from app.domain.names import LONGEST
from app.i18n import _
from app.screens.common.options import Card, MenuItem, Option
from app.screens.common.problems import sentence_of
from app.screens.settings import groups_view as view
from app.screens.settings.page import PageContext
from app.services.planning.planned import Conflict
from app.widgets.display import SectionCard
from app.widgets.sheet import Sheet

USUAL_MOST = 1  # as the word says; its help explains larger numbers
STEPS = {"fewer": -1, "more": 1}


class PlacesBox(SectionCard):
    """The places, in the stead of the missions."""

    part = ObjectProperty(None, rebind=True, allownone=True)


class PlacesPart(EventDispatcher):
    """The rows of the places, and what is pressed there."""

    items = ListProperty()

    def __init__(self, context: PageContext) -> None:
        super().__init__()
        self._context = context
        self._most: dict[int, int] = {}  # chosen and not read yet

    def show(self) -> None:
        facts, sheet = self._context.facts, self._context.shell.sheets.top
        read = {place.id: place.most for place in facts.places}
        self._most = {key: most for key, most in self._most.items() if read.get(key) != most}
        chosen = sheet.show_facts(self._most) if isinstance(sheet, PlaceSheet) else 0
        self.items = view.place_items(facts, {**read, **self._most}, chosen)

    # ------------------------------------------------------------------ what is pressed
    def act(self, key: int | str, action: str, *values: Any) -> None:
        """On the row of a place (key: its id), or of a position that is proposed (its guid)."""
        facts = self._context.facts
        if isinstance(key, str):
            self._answer(key, action)
        elif (place := facts.place(key)) is None:
            return
        elif action == "open":
            self._open(place)
        elif action == "dots":
            self._menu(place, values[0])
        else:
            self.step(place.id, max(1, self._most.get(place.id, place.most) + STEPS[action]))

    def add(self) -> None:
        self._open(Place("", USUAL_MOST))

    def explain(self, button: Widget) -> None:
        words = _(
            "A start that needs a full place waits. Robots avoid collisions themselves: this only prevents queues. "
            "With 1, a place is empty while the next robot drives up. 2 or 3 keep it in use."
        )
        self._context.shell.dialogs.cards(button, [Card(_("Robots at a time"), words, ())], lambda *_args: None)

    def step(self, place_id: int, most: int) -> None:
        self._most[place_id] = most
        context = self._context

        def refused(problem: BaseException) -> None:
            self._most.pop(place_id, None)
            self.show()
            context.shell.say_problem(problem)

        def save() -> None:
            if place := context.facts.place(place_id):
                stepped = replace(place, most=most)
                context.run(
                    lambda: context.services.catalogue.save_place(stepped),
                    lambda saved: context.was_saved("places", saved),
                    refused,
                )

        context.save_at_rest(("place", place_id), save)
        self.show()

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

    def _menu(self, place: Place, button: Widget) -> None:
        delete = MenuItem("delete", _("Delete place"), "delete-outline", tone="fault")
        self._context.shell.dialogs.menu(button, place.name, [delete], lambda _key: self._remove(place))

    def _remove(self, place: Place) -> None:
        context = self._context
        context.shell.sheets.give_up()
        context.remove(
            lambda: context.services.catalogue.remove_place(place.id), _("{place} deleted").format(place=place.name)
        )

    def _open(self, place: Place) -> None:
        self._context.shell.sheets.show(PlaceSheet(self._context, place, self.step))
        self.show()


class PlaceSheet(Sheet):
    """Adds a place, or edits one, which is saved at once. ``step(id, most)`` saves how many robots it takes."""

    name = StringProperty()
    most = NumericProperty(USUAL_MOST)
    missions_phrase = StringProperty()
    name_problem = StringProperty()
    saving = BooleanProperty(False)
    warning = StringProperty()  # that it will be wanted too much

    def __init__(self, context: PageContext, place: Place, step: Callable[[int, int], object]) -> None:
        self._context, self._place, self._step = context, place, step
        super().__init__(foot="" if place.id else _("Add place"))
        self._show()

    def show_facts(self, most: dict[int, int]) -> int:
        """The place as it is now, with the ``most`` that is not read yet. Returns its id."""
        place = self._context.facts.place(self._place.id)
        if place is not None and not self.saving:
            place = replace(place, most=most.get(place.id, place.most))
            if place != self._place:
                self._place = place
                self._show()
        return self._place.id

    def _show(self) -> None:
        place, facts = self._place, self._context.facts
        self.title = (place.name if place.id else "") or _("Add place")
        self.name, self.most = place.name, place.most
        self.missions_phrase = view.missions_phrase(facts, place.missions)

        def found(conflict: Conflict | None) -> None:
            zone = ZoneInfo(facts.settings.timezone)
            self.warning = conflicts.sentence(conflict.code, conflict.at, conflict.details, zone, _) if conflict else ""

        plan = self._context.services.plan
        self._context.run(lambda: plan.place_warning(place), found, lambda _problem: None, key="place warning")

    # ------------------------------------------------------------------ what is changed
    def set_most(self, most: int) -> None:
        if self._place.id:
            self._step(self._place.id, most)
        else:
            self.change(most=most)

    def change(self, **values: Any) -> None:
        self._place = replace(self._place, **values)
        self._show()
        self.draft = not self._place.id
        if self._place.id:
            self.save()

    def pick_missions(self) -> None:
        facts = self._context.facts
        options = [
            Option(
                mission.id,
                mission.name,
                "flag-outline",
                _("Only {robot}").format(robot=robot.name) if (robot := facts.robot(mission.robot_id)) else "",
            )
            for mission in facts.missions
        ]
        self._context.shell.dialogs.choose_many(
            _("Missions that use it"),
            options,
            _("Set"),
            lambda keys: self.change(missions=tuple(keys)),
            selected=self._place.missions,
        )

    def save(self, **values: Any) -> None:
        if self.saving:
            return
        self.saving = True
        place = self._place = replace(self._place, **values)
        before, catalogue = self._context.facts.place(place.id), self._context.services.catalogue

        def saved(place: Place) -> None:
            self.saving = False
            self._place = place
            if before is None:
                self._context.shell.sheets.close()
            self._context.was_saved("places", place)
            self._context.offer_undo(
                (_("{place} saved") if before else _("{place} added")).format(place=place.name),
                lambda: catalogue.save_place(before) if before else catalogue.remove_place(place.id),
            )

        self._context.run(lambda: catalogue.save_place(place), saved, self._refused)

    def _refused(self, problem: BaseException) -> None:
        self.saving = False
        if isinstance(problem, InvalidInput) and problem.field == "name":
            self.name_problem = sentence_of(problem)
        else:
            self._context.shell.say_problem(problem)
