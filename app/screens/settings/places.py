"""Settings, Missions, Places: locations for a limited number of this app's missions at a time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from zoneinfo import ZoneInfo

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.domain import conflicts
from app.domain.models import InvalidInput, Place
from app.domain.names import LONGEST
from app.i18n import _
from app.screens.common.options import Option
from app.screens.common.problems import sentence_of
from app.screens.settings import groups_view as view
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView, went_wrong
from app.services.planning.planned import Conflict
from app.widgets.dialogs import FormDialog
from app.widgets.display import SectionCard
from app.widgets.lists import RecycledRow, Row

USUAL_MOST = 1  # as the word says; its help explains larger numbers


class PlaceRow(RecycledRow, SectionCard):
    """A place and the missions that use it. Actions: "edit", "remove"."""

    name = StringProperty()
    note = StringProperty()


class ProposedPlaceRow(Row, BoxLayout):
    """A position that is not a place yet. Actions: "take", "decline"."""

    text = StringProperty()


class PlacesBox(BoxLayout):
    """The places, in the stead of the missions."""

    page = ObjectProperty(None, rebind=True, allownone=True)


class PlacesPart:
    """What is pressed among the places."""

    def __init__(self, context: PageContext) -> None:
        self._context = context

    def add(self) -> None:
        self._context.shell.dialogs.open(PlaceDialog(self._context))

    def act(self, place_id: int, action: str) -> None:
        context = self._context
        place = context.facts.place(place_id)
        if place is None:
            return
        if action == "edit":
            context.shell.dialogs.open(PlaceDialog(context, place))
        elif action == "remove":
            context.remove(
                lambda: context.services.catalogue.remove_place(place.id), _("{place} deleted").format(place=place.name)
            )

    def answer(self, position: str, action: str) -> None:
        """To what is proposed."""
        context = self._context
        proposed = next((place for place in context.facts.proposed if place.position == position), None)
        if proposed is None:
            return
        if action == "take":
            context.shell.dialogs.open(
                PlaceDialog(context, proposed=Place(proposed.name[:LONGEST], USUAL_MOST, proposed.missions))
            )
        elif action == "decline":
            context.change(lambda: context.services.proposed_places.decline(position))


class PlaceForm(EventDispatcher):
    """What is entered, with one problem per field."""

    title = StringProperty()
    name = StringProperty()
    most = NumericProperty(USUAL_MOST)
    missions = ListProperty()
    missions_phrase = StringProperty()
    name_problem = StringProperty()
    most_problem = StringProperty()
    warning = StringProperty()  # that it will be wanted too much
    outcome = ObjectProperty(NoticeView())
    saving = BooleanProperty(False)


class PlaceDialog(FormDialog):
    """Adds a place, perhaps one that is ``proposed``, or edits one."""

    vm = ObjectProperty(None, rebind=True, allownone=True)

    def __init__(
        self, context: PageContext, place: Place | None = None, proposed: Place | None = None, **kwargs: Any
    ) -> None:
        self._context, self._stored = context, place
        stored = place or proposed or Place("", USUAL_MOST)
        form = PlaceForm(
            title=_("Edit {place}").format(place=place.name) if place else _("Add place"),
            name=stored.name,
            most=stored.most,
            missions=list(stored.missions),
        )
        super().__init__(vm=form, **kwargs)
        form.fbind("name", lambda *_args: setattr(form, "name_problem", ""))
        for name in ("missions", "most"):
            form.fbind(name, self._chosen)
        self._chosen()

    def _chosen(self, *_args: Any) -> None:
        self.vm.missions_phrase = view.missions_phrase(self._context.facts, self.vm.missions)
        place, zone = self._entered(), self._context.facts.settings.timezone

        def found(conflict: Conflict | None) -> None:
            self.vm.warning = (
                conflicts.sentence(conflict.code, conflict.at, conflict.details, ZoneInfo(zone), _) if conflict else ""
            )

        self._context.run(
            lambda: self._context.services.plan.place_warning(place), found, lambda _problem: None, key="place warning"
        )

    def _entered(self) -> Place:
        form = self.vm
        return replace(
            self._stored or Place("", USUAL_MOST),
            name=form.name.strip(),
            most=int(form.most),
            missions=tuple(form.missions),
        )

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
            lambda keys: setattr(self.vm, "missions", keys),
            selected=self.vm.missions,
        )

    def save(self) -> None:
        form = self.vm
        if form.saving or self.ids.most_field.outside:  # it shows why
            return
        form.saving = True
        place = self._entered()
        self._context.run(lambda: self._context.services.catalogue.save_place(place), self._saved, self._refused)

    def _saved(self, place: Place) -> None:
        self.dismiss()
        self._context.was_saved("places", place)
        self._context.say((_("{place} saved") if self._stored else _("{place} added")).format(place=place.name))

    def _refused(self, problem: BaseException) -> None:
        form = self.vm
        form.saving = False
        field = problem.field if isinstance(problem, InvalidInput) else ""
        if field in ("name", "most"):
            setattr(form, f"{field}_problem", sentence_of(problem))
        else:
            form.outcome = went_wrong(problem)
