"""The sheet that adds or edits one thing in Settings: a group, a mission. Refusals are shown at their fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain.models import InvalidInput
from app.i18n import _
from app.screens.common.options import MenuItem
from app.screens.common.problems import sentence_of
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView, went_wrong
from app.widgets.sheet import Sheet


def delete_menu(context: PageContext, button: Widget, delete: Callable[[], object]) -> None:
    items = [MenuItem("delete", _("Delete"), "delete-outline", tone="fault")]
    context.shell.dialogs.menu(button, "", items, lambda _key: delete())


class EditForm(EventDispatcher):
    """What is entered; a field ``x`` that may be refused has an ``x_problem``."""

    title = StringProperty()
    outcome = ObjectProperty(NoticeView())
    saving = BooleanProperty(False)
    is_known = BooleanProperty(False)


class EditSheet(Sheet):
    """Of ``stored``, or of something new (None). With ``at_once`` a change of what is stored is saved when it is made, with Undo."""

    vm = ObjectProperty(None, rebind=True, allownone=True)
    kind = ""  # what it is called in the facts
    at_once = False

    def __init__(self, context: PageContext, stored: Any, form: EditForm, **kwargs: Any) -> None:
        self.context, self.stored = context, stored
        form.is_known = stored is not None
        super().__init__(vm=form, **kwargs)

    @property
    def stored_id(self) -> int | None:
        return self.stored.id if self.stored is not None else None

    # ------------------------------------------------------------------ what each kind does
    def entered(self) -> Any:
        """``stored`` with what is entered."""
        raise NotImplementedError

    def write(self, entered: Any) -> Any:
        """Save it, and return it as it is stored. Not on the UI thread; raises InvalidInput."""
        raise NotImplementedError

    def remove(self) -> None:
        """Delete was chosen."""
        raise NotImplementedError

    def show_facts(self) -> None:
        """Something may have changed elsewhere."""

    # ------------------------------------------------------------------ the same for all
    def on_dots(self, button: Widget) -> None:
        delete_menu(self.context, button, self.delete)

    def delete(self) -> None:
        self.context.shell.sheets.close()
        self.remove()

    def save(self) -> None:
        if self.vm.saving:
            return
        entered = self.entered()
        self.vm.saving, self.vm.outcome = True, NoticeView()

        def done(saved: Any) -> None:
            self._was_saved(saved)
            if self.at_once and self.entered() != entered:  # changed again
                self.save()

        self.context.run(lambda: self.write(entered), done, self.refuse)

    def _was_saved(self, saved: Any) -> None:
        context, before = self.context, self.stored
        self.vm.saving, self.stored = False, saved
        context.was_saved(self.kind, saved)
        if before is None or not self.at_once:
            context.shell.sheets.close()
            context.say((_("{name} saved") if before is not None else _("{name} added")).format(name=saved.name))
        elif saved != before:
            text = _("{name} saved").format(name=saved.name)
            context.shell.offer_undo(text, lambda: self.write(before), context.refresh, behind="settings", about=self)

    def refuse(self, problem: BaseException) -> None:
        """Say why at the field that it is about."""
        self.vm.saving = False
        name = f"{problem.field}_problem" if isinstance(problem, InvalidInput) else ""
        if hasattr(self.vm, name):
            setattr(self.vm, name, sentence_of(problem))
        else:
            self.vm.outcome = went_wrong(problem)
