"""The parts of the Scheduler as kv/scheduler lays them out."""

from __future__ import annotations

from dataclasses import replace

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.screens.scheduler.form import FormModel
from app.screens.scheduler.form_view import FormView
from app.widgets import lanes, list_row  # noqa: F401  (registers kivy classes)
from app.widgets.buttons import CommandButton
from app.widgets.display import EmptyState
from app.widgets.events import Fires
from app.widgets.fields import Field
from app.widgets.items import Item
from app.widgets.lists import Row
from app.widgets.scrolling import CalmScroll, top_of_page, turn_to
from app.widgets.sheet import Sheet
from app.widgets.slots import SlotPart
from app.widgets.surfaces import Tap


class PlanPage(SlotPart):
    """The plan's tools and its lanes; ``card`` is the screen."""


class HoursPart(CalmScroll):
    """The lanes; many robots scroll."""

    vm = ObjectProperty(None, allownone=True, rebind=True)


class FreeButton(CommandButton):
    """On free time that was tapped: a schedule begins there."""


class SchedulerEmpty(EmptyState):
    """No robot exists yet."""

    card = ObjectProperty(None, rebind=True, allownone=True)


class SchedulesPage(SlotPart):
    """The list of schedules and its tools; ``card`` is the screen."""

    def rows(self, rows: list[Item], form: FormModel, is_open: bool) -> list[Item]:
        """The one that is being edited is marked."""
        return [replace(row, look="chosen") if is_open and row.key == form.editing else row for row in rows]


class ScheduleRow(list_row.ListRow):
    """One of them."""


class SuggestionRow(list_row.ListRow):
    """One of them."""


class FormSheet(Sheet):
    """The form beside the plan; ``card`` is its model."""

    card = ObjectProperty(None, rebind=True)
    view = ObjectProperty(FormView(), rebind=True)
    warning = StringProperty()  # above Save, while a note that says it is out of sight

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self._look = Clock.create_trigger(self._look_for_notes, 0.05)  # once they have their places
        self.fbind("view", self._look)
        self.ids.page.bind(scroll_y=self._look, height=self._look, content_height=self._look)
        self.ids.foot.add_widget(FormWarning(sheet=self), index=len(self.ids.foot.children))

    def on_close(self) -> None:
        """The model closes it, and brings entries back."""
        self.card.put_aside()

    def show_wrong_number(self) -> bool:
        """One that can't be is corrected before Save. Returns whether there is one."""
        wrong = next((each for each in self.walk(restrict=True) if isinstance(each, Field) and each.outside), None)
        if wrong is not None:
            turn_to(wrong)
        return wrong is not None

    def show_warning(self) -> None:
        """The first of the notes."""
        turn_to(self._notes()[0])

    def _notes(self) -> list[FormNote]:
        return [each for each in self.walk(restrict=True) if isinstance(each, FormNote) and not each.item.quiet]

    def _look_for_notes(self, _dt: float) -> None:
        page = self.ids.page
        low, high = (page.to_window(0, y)[1] for y in (page.y, page.top))
        seen = all(
            low <= note.to_window(0, note.y)[1] < note.to_window(0, note.top)[1] <= high for note in self._notes()
        )
        self.warning = "" if seen else self.view.warning


class FormWarning(Tap):
    """Above Save: what may go wrong, in one line that leads to it."""

    sheet = ObjectProperty(None, rebind=True)


class FormNote(Row, BoxLayout):
    """What may go wrong, and the buttons that help."""


class RemedyButton(Row, CommandButton):
    """One of those buttons."""


class FormFold(Tap):
    """Shows the rarer fields, which come below it to the top of the sheet, or in a few words what is unusual in them."""

    card = ObjectProperty(None, rebind=True, allownone=True)

    def turn(self) -> None:
        """Show them, or hide them."""
        self.card.more = not self.card.more
        if self.card.more:
            Clock.schedule_once(lambda _dt: top_of_page(self), 0.05)  # once they have their heights


class StartLine(Row, BoxLayout):
    """One of the next starts."""


class SwitchLine(Fires, BoxLayout):
    """A text, what it means, and a switch: ``on_switch(wanted)``."""

    text = StringProperty()
    note = StringProperty()
    active = BooleanProperty(False)

    __events__ = ("on_switch",)
