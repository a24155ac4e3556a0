"""Suggestions: schedules that are often late, why, and what would help. Accepting opens the filled form; nothing
changes until it is saved, and both can be undone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.domain.models import Schedule
from app.i18n import _, ngettext
from app.screens.common.shell import Shell
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices
from app.services.suggestions import suggestions as words
from app.services.suggestions.suggestions import Advice, Change, Suggestion
from app.widgets.dialogs import FormDialog
from app.widgets.lists import Row
from app.widgets.surfaces import Surface

SOON = 5.0  # s after the Scheduler was opened, so that it is drawn first
AGAIN = timedelta(hours=12)


@dataclass(frozen=True)
class ChangeView:
    """Values of SuggestionChange; ``key``: which of the suggestion's."""

    key: int
    promise: str
    action: str


@dataclass(frozen=True)
class SuggestionView:
    """Values of SuggestionPanel; ``key``: id of the schedule."""

    key: int
    text: str
    changes: tuple[ChangeView, ...]


def suggestion_views(advice: Advice, called: Callable[[Schedule], str]) -> list[SuggestionView]:
    return [
        SuggestionView(
            one.schedule.id,
            words.sentence(one, _, called(one.schedule)),
            tuple(
                ChangeView(number, words.promise(change, _), words.action(change, _))
                for number, change in enumerate(one.changes)
            ),
        )
        for one in advice.suggestions
    ]


def title(advice: Advice | None) -> str:
    """Empty without suggestions."""
    if advice is None or not (advice.suggestions or advice.results):
        return ""
    count = len(advice.suggestions)
    return (
        ngettext("Suggestions ({n})", "Suggestions ({n})", count).format(n=count)
        if count
        else _("Results of suggestions")
    )


class AdviceState(EventDispatcher):
    """Read by kv. Hidden without a ``title``."""

    title = StringProperty()
    rows = ListProperty()
    results = StringProperty()
    busy = BooleanProperty(False)  # being computed

    def open_dialog(self) -> None:
        """All of them."""

    def act(self, key: int, action: str, *values: Any) -> None:
        """One was used."""


class AdviceModel(AdviceState):
    """``facts()`` are the present ones, ``edit(draft)`` opens a draft in the form; ``changed()`` is called when the
    plan has changed."""

    def __init__(
        self,
        services: SchedulerServices,
        shell: Shell,
        facts: Callable[[], SchedulerFacts],
        edit: Callable[[Draft], object],
        changed: Callable[[], object],
    ) -> None:
        super().__init__()
        self._services, self._shell, self._facts, self._edit, self._changed = services, shell, facts, edit, changed
        self._advice = Advice()
        self._computed_at: datetime | None = None
        self._in_form: tuple[Suggestion, Change] | None = None  # what was taken and not saved yet
        self._dialog: SuggestionsDialog | None = None

    # ------------------------------------------------------------------ what there is
    def opened(self) -> Callable[[], None]:
        """Compute them when the screen has been drawn, if they are old. Returns what ends it."""
        event = Clock.schedule_once(lambda _dt: self._compute_if_old(), SOON)
        return lambda: event.cancel()

    def _compute_if_old(self) -> None:
        latest, now = self._services.suggestions.latest, self._services.clock.now()
        if latest is not None and self._computed_at is not None and now - self._computed_at < AGAIN:
            self._take(latest)
        else:
            self.compute()

    def compute(self) -> None:
        """Seconds of work, in the background."""
        self.busy = True
        self._shell.background.run(
            self._services.suggestions.compute,
            self._computed,
            self._not_computed,
            key=("scheduler", "suggestions"),
            apart="suggestions",
        )

    def _computed(self, advice: Advice) -> None:
        self._computed_at = self._services.clock.now()
        self._take(advice)

    def _not_computed(self, problem: BaseException) -> None:
        self.busy = False
        self._shell.say_problem(problem)

    def _take(self, advice: Advice) -> None:
        self.busy, self._advice = False, advice
        self.show()

    def show(self) -> None:
        called = self._facts().called
        self.title = title(self._advice)
        if not self.title and self._dialog is not None:
            self._dialog.dismiss()  # with its text: it must not look empty while it closes
            return
        self.rows = suggestion_views(self._advice, called)
        self.results = "\n".join(
            words.since_then(result, _, called(result.schedule)) for result in self._advice.results
        )

    def open_dialog(self) -> None:
        self._dialog = SuggestionsDialog(state=self)
        self._shell.dialogs.open(self._dialog)

    # ------------------------------------------------------------------ what is answered
    def act(self, key: int, action: str, *values: Any) -> None:
        one = next((one for one in self._advice.suggestions if one.schedule.id == key), None)
        if one is None:
            return
        if action == "take":
            self._open_form(one, one.changes[values[0]])
        else:
            self._dismiss(one)

    def _open_form(self, one: Suggestion, change: Change) -> None:
        """Filled with the change; it is saved as any edit."""
        self._in_form = one, change
        if self._dialog is not None:
            self._dialog.dismiss()
        self._edit(replace(Draft.of(change.draft, self._facts().name(one.schedule)), base=one.schedule))

    def saved(self, schedule: Schedule) -> bool:
        """A schedule was saved in the form: if it is the suggested change (returned), it is recorded with a message,
        and both can be undone."""
        taken = self._in_form
        if taken is None or taken[0].schedule.id != schedule.id:
            return False
        self._in_form = None
        if not _is_change(schedule, taken[1]):
            return False
        (one, change), text = taken, _("{name}: the suggestion is applied").format(name=self._facts().called(schedule))

        def undo(answer: Any) -> None:
            restored = self._services.catalogue.save_schedule(one.schedule)
            self._services.suggestions.undo_change(answer, one.schedule, restored)

        self._shell.background.run(
            lambda: self._services.suggestions.accept(one, change),
            lambda answer: self._answered(one, text, lambda: undo(answer)),
            self._shell.say_problem,
        )
        return True

    def _dismiss(self, one: Suggestion) -> None:
        suggestions, name = self._services.suggestions, self._facts().called(one.schedule)
        self._shell.background.run(
            lambda: suggestions.dismiss(one),
            lambda answer: self._answered(
                one,
                _("{name}: not suggested again for 60 days").format(name=name),
                lambda: suggestions.undo(answer),
            ),
            self._shell.say_problem,
        )

    def _answered(self, one: Suggestion, text: str, undo: Callable[[], object]) -> None:
        """Remove it at once, even if it was found again since; others may be shown now."""
        left = tuple(each for each in self._advice.suggestions if each.schedule.id != one.schedule.id)
        self._advice = replace(self._advice, suggestions=left)
        self.show()
        self.compute()

        def undone() -> None:
            self._changed()
            self.compute()

        self._shell.offer_undo(text, undo, undone)


def _is_change(schedule: Schedule, change: Change) -> bool:
    """Whether it is now as suggested, ignoring other changes."""
    wanted = change.draft
    return (schedule.id, schedule.start, schedule.robot_id, schedule.group_id) == (
        wanted.id,
        wanted.start,
        wanted.robot_id,
        wanted.group_id,
    )


NO_ADVICE = AdviceState()


class SuggestionPanel(Row, Surface):
    """One finding and what would have helped. Actions: "take" with the number of a change, "dismiss"."""

    text = StringProperty()
    changes = ListProperty()

    def on_kv_post(self, _base_widget: Any) -> None:
        self.fbind("changes", self._build)
        self._build()

    def _build(self, *_args: Any) -> None:
        """No rows inside a row: a touch on the inner one would belong to the outer one."""
        self.ids.changes.clear_widgets()
        for change in self.changes:
            line = SuggestionChange(promise=change.promise, action=change.action)
            line.bind(on_take=lambda _line, key=change.key: self.act("take", key))
            self.ids.changes.add_widget(line)


class SuggestionChange(BoxLayout):
    """What would help, and the button that opens the form: ``on_take``."""

    promise = StringProperty()
    action = StringProperty()

    __events__ = ("on_take",)

    def on_take(self) -> None:
        """The button was pressed."""


class SuggestionsDialog(FormDialog):
    """All suggestions, and the results of accepted ones."""

    state = ObjectProperty(NO_ADVICE, rebind=True)
