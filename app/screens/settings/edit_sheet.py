"""The sheet that adds, edits or deletes one thing in Settings: a robot, a mission. Refusals are shown at their fields."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import fields, replace
from functools import partial
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
        self._was: dict[str, Any] = {}  # what Undo brings back: the values before the first change of each
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

    def delete(self, it: Any) -> Removed:
        """Delete ``it``, on another thread."""
        raise NotImplementedError

    def question(self) -> str:
        """What goes with it when it is deleted; empty: nothing."""
        return ""

    def more(self) -> list[Option]:
        """What else its menu offers; the keys are what is done."""
        return []

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
            self._forget_changed(self.stored, stored)
            was, now = self.shown(self.stored), self.shown(stored)
            names = _differing(was, now) - _differing(was, self.it) - self.problems.keys()
            self.stored, self.it = stored, replace(self.it, **{name: getattr(now, name) for name in names})

    # ------------------------------------------------------------------ what is pressed
    def on_done(self) -> None:
        self.save()

    def on_dots(self, button: Widget) -> None:
        delete = Option(self.remove, _("Delete"), "delete-outline", tone="fault")
        self.context.shell.dialogs.menu(button, "", [*self.more(), delete], lambda act: act())

    # ------------------------------------------------------------------ delete
    def remove(self) -> None:
        """Ask first if more goes with it."""
        if question := self.question():
            title = _("Delete {name}?").format(name=self.stored.name)
            self.context.shell.sheets.ask(title, question, _("Delete"), self.remove_at_once, _("Keep"))
        else:
            self.remove_at_once()

    def remove_at_once(self) -> None:
        """With Undo."""
        context, it = self.context, self.stored

        def deleted(what: Removed) -> None:
            context.refresh()
            text = _("{name} deleted").format(name=it.name)
            context.offer_undo(text, lambda: context.services.catalogue.restore(what))

        context.shell.sheets.close(self)
        context.run(lambda: self.delete(it), deleted)

    # ------------------------------------------------------------------ save
    def settled(self) -> Any:
        """What is stored, with what is saved at once."""
        entered = self.entered()
        return replace(self.stored, **{name: getattr(entered, name) for name in self.at_once})

    def keep(self) -> None:
        """Save what was changed of something that is stored, and nothing else of it."""
        if self.stored is not None and not self.saving and (settled := self.settled()) != self.stored:
            self.store(settled, is_kept=True)

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
            self.store(self.entered(), **self.how())

    def store(self, entered: Any, *, is_kept: bool = False, **how: Any) -> None:
        """Save it; what ``is_kept`` is saved at once, otherwise the sheet closes. Undo restores all that was
        changed in the sheet, but no connection (``how``): it brings no former password back."""
        context, before, kind, catalogue = self.context, self.stored, self.kind, self.context.services.catalogue
        self.saving, self.outcome = not is_kept, NoticeView()
        if is_kept:
            self.stored = entered
            self._unwritten += 1

        def done(saved: Any) -> None:
            if not is_kept:
                self.saving, self.stored = False, saved
                context.shell.sheets.close(self)
            text = (_("{name} added") if before is None else _("{name} saved")).format(name=saved.name)
            if changed := not how and before and _differing(before, entered) & _differing(before, saved):
                self._was = {name: getattr(before, name) for name in changed} | self._was
                self._forget_changed(entered, saved)
                undo = partial(catalogue.change_back, replace(saved, **self._was), saved)
                context.shell.offer_undo(text, undo, context.refresh, behind="settings", about=self)
            elif not is_kept:
                context.say(text)
            context.was_saved(kind, saved)
            if before is None:
                self.was_added(saved)
            self._unwritten -= is_kept
            if self._waits is not None and not self._unwritten:
                act, self._waits = self._waits, None
                act()

        def not_done(problem: BaseException) -> None:
            """What is red stays, to be corrected."""
            self._unwritten -= is_kept
            self._waits = None
            self.refuse(problem)

        context.change(
            lambda: catalogue.change(before, entered, **how),
            not_done,
            shown=lambda facts: facts.having(kind, entered) if is_kept else facts,
            done=done,
        )

    def _forget_changed(self, ours: Any, stored: Any) -> None:
        """What was changed elsewhere since is not for this sheet to undo."""
        for name in _differing(ours, stored) & self._was.keys():
            del self._was[name]

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
