"""Suggestions: schedules that are often late, why, and what would help. Accepting opens the filled form; nothing
changes until it is saved, and both can be undone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, NumericProperty

from app.domain.models import Schedule
from app.i18n import _
from app.screens.common import formats
from app.screens.common.shell import Shell
from app.screens.scheduler import view
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices
from app.services.suggestions import suggestions as words
from app.services.suggestions.suggestions import Advice, Change, Result, Suggestion
from app.widgets.items import Action, Item, Option

SOON = 5.0  # s after the Scheduler was opened, so that it is drawn first
AGAIN = timedelta(hours=12)


def suggestion_items(advice: Advice, facts: SchedulerFacts) -> list[Item]:
    """A row for each suggestion, with a button for each change that would help; below them the results of those taken."""
    items = [_suggestion(one, facts) for one in advice.suggestions]
    if advice.results:
        items.append(Item("taken", _("Taken"), look="head", opens=False))
    return items + [_result(each, facts) for each in advice.results]


def _suggestion(one: Suggestion, facts: SchedulerFacts) -> Item:
    found = one.finding
    late = _("{late} of {starts} starts late").format(late=found.late, starts=found.starts)
    if found.typical_s is not None:
        late = _("{late}, about {time}").format(
            late=late, time=formats.rough_duration(max(60, round(found.typical_s / 60) * 60))
        )
    actions = tuple(
        Action(f"take {number}", words.action(change, _), style="outlined") for number, change in enumerate(one.changes)
    )
    return Item(
        one.schedule.id,
        _title(one.schedule, facts),
        late,
        icon="lightbulb-on-outline",
        tone="attention",
        aside=f"{_rule(one.schedule, facts)}, {one.whose}",
        note=words.because(one, _),
        actions=(*actions, Action("menu", icon="dots-vertical")),
        below=True,
        opens=False,
    )


def _result(result: Result, facts: SchedulerFacts) -> Item:
    counts = _("{late} of {starts} late since, {before} of {all} before").format(
        late=result.late, starts=result.starts, before=result.before.late, all=result.before.starts
    )
    return Item(
        ("taken", result.schedule.id),
        _title(result.schedule, facts),
        _rule(result.schedule, facts),
        counts,
        icon="check",
        tone="done",
        opens=False,
    )


def _rule(schedule: Schedule, facts: SchedulerFacts) -> str:
    return view.zoned(view.short_rule(schedule), schedule.timezone, facts)


def _title(schedule: Schedule, facts: SchedulerFacts) -> str:
    mission = facts.mission(schedule.mission_id)
    return facts.name(schedule) or (mission.name if mission else schedule.name)


class AdviceModel(EventDispatcher):
    """Read by kv; ``count``: suggestions, not results. ``facts()`` are the present ones, ``edit(draft)`` opens a draft in the form;
    ``changed()`` is called when the plan has changed."""

    rows = ListProperty()
    count = NumericProperty(0)
    empty = BooleanProperty(False)  # it is known that there are none

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

    # ------------------------------------------------------------------ what there is
    def opened(self) -> Callable[[], None]:
        """Compute them when the screen has been drawn, if they are old. Returns what ends it."""
        if self._computed_at is not None:  # the language may have changed since
            self.show()
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
        self._shell.background.run(
            self._services.suggestions.compute,
            self._computed,
            self._shell.say_problem,
            key=("scheduler", "suggestions"),
            apart="suggestions",
        )

    def _computed(self, advice: Advice) -> None:
        self._computed_at = self._services.clock.now()
        self._take(advice)

    def _take(self, advice: Advice) -> None:
        self._advice = advice
        self.show()

    def show(self) -> None:
        self.rows, self.count = suggestion_items(self._advice, self._facts()), len(self._advice.suggestions)
        self.empty = not self.rows

    # ------------------------------------------------------------------ what is answered
    def act(self, key: int, action: str, *values: Any) -> None:
        one = next((one for one in self._advice.suggestions if one.schedule.id == key), None)
        if one is None:
            return
        if action == "menu":
            anchor, items = values[0], [Option("dismiss", _("Not now"), "bell-off-outline")]
            self._shell.dialogs.menu(
                anchor, _title(one.schedule, self._facts()), items, lambda _key: self._dismiss(one)
            )
        else:
            self._open_form(one, one.changes[int(action.removeprefix("take "))])

    def _open_form(self, one: Suggestion, change: Change) -> None:
        """Filled with the change; it is saved as any edit."""
        self._in_form = one, change
        self._edit(replace(Draft.of(change.draft, self._facts().name(one.schedule)), base=one.schedule))

    def saved(self, schedule: Schedule, undo_change: Callable[[], Any]) -> bool:
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
            self._services.suggestions.undo_change(answer, one.schedule, undo_change())

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
