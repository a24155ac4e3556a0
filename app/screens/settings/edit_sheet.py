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
    """``it`` is ``stored``, or something new, with what is entered; ``problems`` are by the names of its ``fields``. Of
    something stored a change of what is ``at_once`` is saved when it is made, with Undo."""

    stored = ObjectProperty(None, rebind=True, allownone=True)
    it = ObjectProperty(rebind=True)
    problems = DictProperty(rebind=True)
    outcome = ObjectProperty(NoticeView(), rebind=True)
    about = ObjectProperty(NoticeView(), rebind=True)  # what is known of it
    saving = BooleanProperty(False)
    kind = ""  # what it is called in the facts
    fields: Collection[str] = ()  # that are refused here
    at_once: Collection[str] = ()

    def __init__(self, context: PageContext, it: Any, **kwargs: Any) -> None:
        self.context, self._first = context, it
        self._unwritten = 0  # changes that are saved at once
        self._waits: Callable[[], object] | None = None  # what was pressed in that time
        stored = it if it.id else None
        foot = "" if self.at_once and stored is not None else _("Save")
        super().__init__(stored=stored, it=self.shown(it), foot=foot, **kwargs)
        self.show_facts()

    @property
    def stored_id(self) -> int | None:
        return self.stored.id if self.stored is not None else None

    # ------------------------------------------------------------------ what each kind does
    def shown(self, stored: Any) -> Any:
        """As its fields show it."""
        return stored

    def entered(self) -> Any:
        """As it is saved."""
        return self.it

    def how(self) -> dict[str, Any]:
        """It is saved: what ``Catalogue.change`` has to know beyond it."""
        return {}

    def remove(self) -> None:
        """Delete was chosen."""
        raise NotImplementedError

    def was_added(self, saved: Any) -> None:
        """A new one was saved, and the sheet is closed."""

    # ------------------------------------------------------------------ what is entered
    def enter(self, **values: Any) -> None:
        """Something is typed."""
        it = replace(self.it, **values)
        if it != self.it:
            self.it = it
            self.changed(is_name="name" in values)

    def changed(self, *, is_name: bool = False) -> None:
        """What was refused may be right now: the name, or what belongs together."""
        self.problems = {name: said for name, said in self.problems.items() if (name == "name") != is_name}
        self.draft = self.would_be_lost()

    def would_be_lost(self) -> bool:
        """When the sheet closes."""
        kept = self.at_once if self.stored is not None else ()
        return not _differing(self.shown(self.stored or self._first), self.it) <= {*kept}

    def choose(self, **values: Any) -> None:
        """Something is chosen, or a field was left: what is saved at once is saved."""
        self.enter(**values)
        self.keep()

    def show_facts(self) -> None:
        """What has changed elsewhere is shown where nothing else was entered."""
        stored = with_id(getattr(self.context.facts, self.kind), self.stored_id)
        if stored is not None and not self.saving:
            was, now = self.shown(self.stored), self.shown(stored)
            names = _differing(was, now) - _differing(was, self.it) - self.problems.keys()
            self.stored, self.it = stored, replace(self.it, **{name: getattr(now, name) for name in names})

    # ------------------------------------------------------------------ what is pressed
    def on_done(self) -> None:
        self.save()

    def on_dots(self, button: Widget) -> None:
        delete_menu(self.context, button, self.remove)

    # ------------------------------------------------------------------ save
    def settled(self) -> Any:
        """What is stored, with what is saved at once."""
        entered = self.entered()
        return replace(self.stored, **{name: getattr(entered, name) for name in self.at_once})

    def keep(self) -> None:
        """Save what was changed of something that is stored, and nothing else of it."""
        if self.stored is not None and not self.saving and (settled := self.settled()) != self.stored:
            stored, catalogue = self.stored, self.context.services.catalogue
            self.store(lambda: catalogue.change(stored, settled), settled)

    def when_kept(self, act: Callable[[], object]) -> None:
        """Now, or once what is saved at once is written: a finger that leaves a field for *Save* does both."""
        if self._unwritten:
            self._waits = act
        else:
            act()

    def save(self) -> None:
        self.when_kept(self._save)

    def _save(self) -> None:
        if not self.saving:
            entered, stored, how, catalogue = self.entered(), self.stored, self.how(), self.context.services.catalogue
            self.store(lambda: catalogue.change(stored, entered, **how))

    def store(self, write: Callable[[], Any], kept: Any = None) -> None:
        """``kept``: what is saved at once; without it the sheet closes."""
        context, before, kind = self.context, self.stored, self.kind
        change_back = context.services.catalogue.change_back
        self.saving, self.outcome = kept is None, NoticeView()
        if kept is not None:
            self.stored = kept
            self._unwritten += 1

        def done(saved: Any) -> None:
            if kept is None:
                self.saving, self.stored = False, saved
                context.shell.sheets.close(self)
                said = _("{name} added") if before is None else _("{name} saved")
                context.say(said.format(name=saved.name))
            elif was := {name: getattr(before, name) for name in _differing(before, kept) & _differing(before, saved)}:
                text = _("{name} saved").format(name=saved.name)
                context.shell.offer_undo(
                    text,
                    lambda: change_back(replace(saved, **was), saved),
                    context.refresh,
                    behind="settings",
                    about=self,
                )
            context.was_saved(kind, saved)
            if before is None:
                self.was_added(saved)
            self._unwritten -= kept is not None
            if self._waits is not None and not self._unwritten:
                act, self._waits = self._waits, None
                act()

        def not_done(problem: BaseException) -> None:
            """What is red stays, to be corrected."""
            self._unwritten -= kept is not None
            self._waits = None
            self.refuse(problem)

        context.change(
            write,
            not_done,
            shown=lambda facts: facts if kept is None else facts.having(kind, kept),
            done=done,
        )

    def refuse(self, problem: BaseException) -> None:
        """Say why, at the field that it is about."""
        self.saving = False
        if isinstance(problem, InvalidInput) and problem.field in self.fields:
            self.problems[problem.field] = sentence_of(problem)
        else:
            self.outcome = went_wrong(problem)


def _differing(before: Any, after: Any) -> set[str]:
    """The names of the fields in which two objects of one kind differ."""
    return {field.name for field in fields(before) if getattr(before, field.name) != getattr(after, field.name)}
