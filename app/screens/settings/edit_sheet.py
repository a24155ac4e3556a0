"""The sheet that adds, edits or deletes one thing in Settings: a robot, a mission. Refusals are shown at their fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
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
from app.services.catalogue.catalogue import Removed
from app.widgets.sheet import Sheet


def delete_menu(context: PageContext, button: Widget, chosen: Callable[[], object]) -> None:
    items = [MenuItem("delete", _("Delete"), "delete-outline", tone="fault")]
    context.shell.dialogs.menu(button, "", items, lambda _key: chosen())


def ask_and_delete(context: PageContext, it: Any, work: Callable[[], Removed], question: str) -> None:
    """Delete ``it``. If more goes with it, the ``question`` says what."""
    if not question:
        delete(context, it, work)
        return
    context.shell.sheets.ask(
        _("Delete {name}?").format(name=it.name),
        question,
        _("Delete"),
        lambda: delete(context, it, work),
        _("Keep"),
    )


def delete(context: PageContext, it: Any, work: Callable[[], Removed], text: str = "") -> None:
    """Delete ``it`` at once, close its sheet, and offer Undo."""
    text = text or _("{name} deleted").format(name=it.name)

    def deleted(what: Removed) -> None:
        context.refresh()
        context.offer_undo(text, lambda: context.services.catalogue.restore(what))

    sheet = context.shell.sheets.top
    if isinstance(sheet, EditSheet) and (type(sheet.stored), sheet.stored_id) == (type(it), it.id):
        context.shell.sheets.close(sheet)
    context.run(work, deleted)


class EditForm(EventDispatcher):
    """What is entered; a field ``x`` that may be refused has an ``x_problem``."""

    title = StringProperty()
    outcome = ObjectProperty(NoticeView())
    saving = BooleanProperty(False)
    is_known = BooleanProperty(False)


class SettingsSheet(Sheet):
    """Lies beside the page of a section, in a low window over it."""

    def show_facts(self) -> None:
        """Something may have changed elsewhere."""


class EditSheet(SettingsSheet):
    """Of ``stored``, or of something new (None). With ``at_once`` a change of what is stored is saved when it is made, with Undo."""

    vm = ObjectProperty(None, rebind=True, allownone=True)
    kind = ""  # what it is called in the facts
    at_once = False

    def __init__(self, context: PageContext, stored: Any, form: EditForm, **kwargs: Any) -> None:
        self.context, self.stored = context, stored
        form.is_known = stored is not None
        super().__init__(vm=form, foot="" if self.at_once and stored is not None else _("Save"), **kwargs)

    @property
    def stored_id(self) -> int | None:
        return self.stored.id if self.stored is not None else None

    # ------------------------------------------------------------------ what each kind does
    def entered(self) -> Any:
        """``stored`` with what is entered."""
        raise NotImplementedError

    def how(self) -> dict[str, Any]:
        """It is saved: what ``Catalogue.change`` has to know beyond it."""
        return {}

    def remove(self) -> None:
        """Delete was chosen."""
        raise NotImplementedError

    def was_added(self, saved: Any) -> None:
        """A new one was saved, and the sheet is closed."""

    # ------------------------------------------------------------------ the same for all
    def on_done(self) -> None:
        self.save()

    def on_dots(self, button: Widget) -> None:
        delete_menu(self.context, button, self.remove)

    def choose(self, **values: Any) -> None:
        """What is not typed."""
        for name, value in values.items():
            setattr(self.vm, name, value)
        self.keep()

    def settled(self) -> Any:
        """The part of it that is saved at once."""
        return self.entered()

    def keep(self) -> None:
        """Save what was changed of something that is stored, and nothing else of it."""
        if self.stored is not None and not self.vm.saving and (settled := self.settled()) != self.stored:
            stored, catalogue = self.stored, self.context.services.catalogue
            self.store(lambda: catalogue.change(stored, settled), settled)

    def save(self) -> None:
        if not self.vm.saving:
            entered, stored, how, catalogue = self.entered(), self.stored, self.how(), self.context.services.catalogue
            self.store(lambda: catalogue.change(stored, entered, **how))

    def store(self, write: Callable[[], Any], kept: Any = None) -> None:
        """``kept``: what is saved at once; without it the sheet closes."""
        context, before, is_new = self.context, self.stored, self.stored is None
        change_back = context.services.catalogue.change_back
        self.vm.saving, self.vm.outcome = True, NoticeView()

        def done(saved: Any) -> None:
            self.vm.saving, self.stored = False, saved
            if kept is None:
                context.shell.sheets.close(self)
                context.say((_("{name} added") if is_new else _("{name} saved")).format(name=saved.name))
            elif was := {name: getattr(before, name) for name in _differing(before, kept) & _differing(before, saved)}:
                text = _("{name} saved").format(name=saved.name)
                context.shell.offer_undo(
                    text,
                    lambda: change_back(replace(saved, **was), saved),
                    context.refresh,
                    behind="settings",
                    about=self,
                )
            context.was_saved(self.kind, saved)
            if is_new:
                self.was_added(saved)
            if kept is not None and self.settled() != kept:  # changed since
                self.keep()

        context.run(write, done, self.refuse)

    def refuse(self, problem: BaseException) -> None:
        """Say why at the field that it is about."""
        self.vm.saving = False
        name = f"{problem.field}_problem" if isinstance(problem, InvalidInput) else ""
        if hasattr(self.vm, name):
            setattr(self.vm, name, sentence_of(problem))
        else:
            self.vm.outcome = went_wrong(problem)


def _differing(before: Any, after: Any) -> set[str]:
    """The names of the fields in which two objects of one kind differ."""
    return {field.name for field in fields(before) if getattr(before, field.name) != getattr(after, field.name)}
