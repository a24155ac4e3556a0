"""The sheet that adds, edits or deletes one thing in Settings: a robot, a mission. Refusals are shown at their fields."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import fields, replace
from typing import Any

from kivy.properties import BooleanProperty, DictProperty, ObjectProperty
from kivy.uix.widget import Widget

from app.domain.models import InvalidInput
from app.i18n import _
from app.screens.common.name_order import with_id
from app.screens.common.problems import sentence_of
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView, went_wrong
from app.services.catalogue.catalogue import Removed
from app.widgets.items import Option
from app.widgets.sheet import Sheet


def delete_menu(context: PageContext, button: Widget, chosen: Callable[[], object]) -> None:
    items = [Option("delete", _("Delete"), "delete-outline", tone="fault")]
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


class SettingsSheet(Sheet):
    """Lies beside the page of a section, in a low window over it."""

    def show_facts(self) -> None:
        """Something may have changed elsewhere."""


class EditSheet(SettingsSheet):
    """Of ``stored``, or of something new (None). With ``at_once`` a change of what is stored is saved when it is made, with Undo."""

    stored = ObjectProperty(None, rebind=True, allownone=True)
    outcome = ObjectProperty(NoticeView(), rebind=True)
    saving = BooleanProperty(False)
    kind = ""  # what it is called in the facts
    at_once = False

    def __init__(self, context: PageContext, stored: Any, **kwargs: Any) -> None:
        self.context = context
        super().__init__(stored=stored, foot="" if self.at_once and stored is not None else _("Save"), **kwargs)

    @property
    def stored_id(self) -> int | None:
        return self.stored.id if self.stored is not None else None

    # ------------------------------------------------------------------ what each kind does
    def entered(self) -> Any:
        """``stored`` with what is entered."""
        raise NotImplementedError

    def says(self, field: str, problem: str) -> bool:
        """Show the problem at the field, if that is here."""
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

    def settled(self) -> Any:
        """The part of it that is saved at once."""
        return self.entered()

    def keep(self) -> None:
        """Save what was changed of something that is stored, and nothing else of it."""
        if self.stored is not None and not self.saving and (settled := self.settled()) != self.stored:
            stored, catalogue = self.stored, self.context.services.catalogue
            self.store(lambda: catalogue.change(stored, settled), settled)

    def save(self) -> None:
        if not self.saving:
            entered, stored, how, catalogue = self.entered(), self.stored, self.how(), self.context.services.catalogue
            self.store(lambda: catalogue.change(stored, entered, **how))

    def store(self, write: Callable[[], Any], kept: Any = None) -> None:
        """``kept``: what is saved at once; without it the sheet closes."""
        context, before, is_new = self.context, self.stored, self.stored is None
        change_back = context.services.catalogue.change_back
        self.saving, self.outcome = True, NoticeView()

        def done(saved: Any) -> None:
            self.saving, self.stored = False, saved
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
        """Say why, at the field that it is about."""
        self.saving = False
        if not (isinstance(problem, InvalidInput) and self.says(problem.field, sentence_of(problem))):
            self.outcome = went_wrong(problem)


class PlainSheet(EditSheet):
    """``it`` is ``stored``, or something new, with what is entered; ``problems`` are by the names of its ``fields``."""

    it = ObjectProperty(rebind=True)
    problems = DictProperty(rebind=True)
    fields: Collection[str] = ()  # that are refused here

    def __init__(self, context: PageContext, it: Any, **kwargs: Any) -> None:
        self._first = it
        super().__init__(context, it if it.id else None, it=it, **kwargs)
        self.show_facts()

    def entered(self) -> Any:
        return self.it

    def says(self, field: str, problem: str) -> bool:
        if field in self.fields:
            self.problems[field] = problem
        return field in self.fields

    def show_facts(self) -> None:
        """What has changed elsewhere is shown where nothing else was entered."""
        before = self.stored
        now = with_id(getattr(self.context.facts, self.kind), self.stored_id)
        if now is not None and not self.saving:
            changed = {name: getattr(now, name) for name in _differing(before, now) - _differing(before, self.it)}
            self.stored, self.it = now, replace(self.it, **changed)

    def enter(self, **values: Any) -> None:
        """Something is typed. What was refused may be right now: the name, or what belongs together."""
        it = replace(self.it, **values)
        if it != self.it:
            self.it = it
            self.problems = {
                name: said for name, said in self.problems.items() if (name == "name") != ("name" in values)
            }
            self.draft = it != (self.stored or self._first) and bool(self.foot)

    def choose(self, **values: Any) -> None:
        """Something is chosen, or a field was left: what is saved at once is saved."""
        self.enter(**values)
        self.keep()


def _differing(before: Any, after: Any) -> set[str]:
    """The names of the fields in which two objects of one kind differ."""
    return {field.name for field in fields(before) if getattr(before, field.name) != getattr(after, field.name)}
