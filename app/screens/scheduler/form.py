"""The Scheduler's form: keeps one draft, asks for its forecast while it is edited, saves it. Its texts are made by form_view.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime, time
from typing import Any
from zoneinfo import ZoneInfo

from kivy.properties import StringProperty

from app.domain.models import InvalidInput, Schedule
from app.i18n import _
from app.screens.common.missing_mission import fetch_option, or_fetch
from app.screens.common.parameters_view import Problems, values_of
from app.screens.common.problems import sentence_of
from app.screens.scheduler import form_view, of_groups
from app.screens.scheduler.actions import about
from app.screens.scheduler.draft import BEGINS_AT, DAY_BEGINS, MOST, Draft, Kind, Unit
from app.screens.scheduler.facts import SchedulerFacts
from app.screens.scheduler.form_core import FormCore
from app.screens.scheduler.form_view import MORE


class FormModel(FormCore):
    """One draft, from its beginning until it is saved or given up: another one has a form of its own. A form that was put
    aside still saves, and can be brought back."""

    missing = StringProperty()  # which of the mission's values has to be given first

    # ------------------------------------------------------------------ what is edited
    @property
    def editing(self) -> int | None:
        """The schedule that is being edited."""
        return self._draft.base.id if self.is_open and self._draft.base else None

    def open(self) -> None:
        """Again or for the first time."""
        self._asked_of, self.is_open = None, True
        self._changed()

    def put_aside(self) -> None:
        """What was entered can be brought back; what waits for the robot is saved."""
        self.wait_no_more()
        if self.is_open and not self._submitted and self._draft != self._begun:
            self._offer_back(_("{name}: not saved").format(name=form_view.called(self._facts, self._draft)))
        self.is_open = False

    def _offer_back(self, said: str) -> None:
        schedule = self._draft.base
        self._shell.snackbars.undo(
            said,
            _("Undo"),
            lambda: self._shell.go("scheduler", form=self),
            about=("draft", schedule.id) if schedule is not None else self,
        )

    def take(self, facts: SchedulerFacts) -> None:
        """Facts were read again. An untouched new form follows their defaults."""
        self._facts = facts
        if self._proposes and self._draft == self._begun:
            self._draft = self._begun = self._fresh()
        self._ask_parameters()
        self.forecast()

    def aim(self, robot_id: int, at: datetime) -> None:
        """A finger has chosen robot and time: that alone is no entry."""
        is_untouched = self._draft == self._begun
        local = at.astimezone(ZoneInfo(self._draft.timezone)).replace(tzinfo=None)
        self._change(replace(self._draft.with_day(local.date()).aimed_at(robot_id), at=local.time()))
        if is_untouched:
            self._begun, self._proposes = self._draft, False

    # ------------------------------------------------------------------ saving
    def save(self, parameters: Mapping[str, Any] | None = None) -> None:
        """``parameters``: the values in their fields, by name; None: those that were entered."""
        if self.saving or self.view.why:
            return
        self.problems = {}
        if self._is_asking:
            self._save_when_known()
            return
        if self._asked:
            try:
                self._draft = replace(self._draft, parameters=values_of(self._asked, parameters or self._given))
            except Problems as problems:
                self.problems = dict(problems.by_name)  # at the fields, which may be out of sight
                labels = {field.name: field.label for field in self.parameters}
                name, problem = next(iter(problems.by_name.items()))
                self._shell.snackbars.show(
                    _("{field}: {problem}").format(field=labels[name], problem=problem), icon="alert-circle-outline"
                )
                return
        draft, schedule, catalogue = self._draft, self._draft.schedule(), self._services.catalogue
        before = draft.base and replace(draft.base, name=self._begun.name)  # what was generated is no entry
        self.saving = self._submitted = True
        self._shell.background.run(
            lambda: catalogue.save_schedule(schedule) if before is None else catalogue.change(before, schedule),
            lambda saved: self._is_saved(draft, saved),
            lambda problem: self._not_saved(draft, problem),
        )

    @property
    def _given(self) -> dict[str, Any]:
        """The values in the fields of the parameters."""
        return {**{field.name: field.default for field in self.parameters}, **self._draft.entered}

    def _is_saved(self, draft: Draft, schedule: Schedule) -> None:
        """Entries that were made since are not."""
        name, is_done = self._facts.called(schedule), self._submitted
        self.saving = self._submitted = False
        self._shell.snackbars.end(about(schedule.id))  # an Undo of what was there before
        self._shell.snackbars.end(("draft", schedule.id))  # what was entered for it before, and not saved
        is_said = self._host.saved(schedule)
        self._begun, self._draft = replace(draft, base=schedule), replace(self._draft, base=schedule)
        if is_done:
            self.is_open = False
        else:
            self._changed()
        if not is_said:
            self._shell.snackbars.show(
                _("{name} is planned").format(name=name) if draft.is_new else _("{name} is changed").format(name=name),
                icon="calendar-check",
            )

    def _not_saved(self, draft: Draft, problem: BaseException) -> None:
        is_unchanged = self._submitted and self._draft == draft
        self.saving = self._submitted = False
        name = form_view.called(self._facts, draft)
        if not self.is_open:  # somebody is on with another one, in good faith
            self._offer_back(_("{name}: {problem}").format(name=name, problem=sentence_of(problem)))
        elif isinstance(problem, InvalidInput) and is_unchanged:
            self._refused = problem
            self.show()
        else:
            self._shell.say_problem(problem, name)

    def leave(self) -> None:
        """Another screen is shown: the next reading asks for the forecast."""
        self.wait_no_more()
        self._forecast_later.cancel()

    # ------------------------------------------------------------------ its fields
    def set(self, **values: Any) -> None:
        """Change fields of the draft."""
        self._change(replace(self._draft, **values))

    def remedy(self, values: tuple[tuple[str, Any], ...]) -> None:
        """A note's button was pressed: fields, and their values."""
        changed = dict(values)
        day = changed.pop("day", None)
        self._change(replace(self._draft if day is None else self._draft.with_day(day), **changed))

    def choose_mission(self) -> None:
        if not form_view.mission_options(self._facts, self._draft.target):
            self._shell.sheets.ask(
                _("No missions yet"),
                _("Missions are made on the robot. In Settings they are fetched from it."),
                _("Open Settings"),
                lambda: self._shell.go("settings", section="missions"),
            )
            return
        self.choose("mission_id")

    def pick_day(self) -> None:
        today = self._local_now().date()
        self._shell.dialogs.pick_date(
            _("Day") if self._draft.kind is Kind.ONCE else _("First day"),
            self._draft.day,
            lambda day: self._change(self._draft.with_day(day)),
            today=today,
            first=min(today, self._draft.day),
        )

    def pick_last_day(self) -> None:
        self._shell.dialogs.pick_date(
            _("Last day"),
            self._draft.last_day or self._draft.day,
            lambda day: self.set(last_day=day),
            today=self._local_now().date(),
            first=self._draft.day,
        )

    def pick_time(self, field: str) -> None:
        self._shell.dialogs.pick_time(_("Time"), getattr(self._draft, field), lambda at: self.set(**{field: at}))

    # ------------------------------------------------------------------ the other fields
    def choose_kind(self, kind: str) -> None:
        """Of the rarer ones first that of so many minutes."""
        if kind == MORE:
            self._repeat((Kind.OTHER, "") if self._draft.other_rule else form_view.REPEATS[0])
        else:
            self.set(kind=Kind(kind))

    def choose_repeats(self) -> None:
        options, selected = form_view.repeats_options(self._draft), form_view.repeats_of(self._draft)
        self._shell.dialogs.choose(_("Repeats"), options, self._repeat, selected=selected)

    def _repeat(self, key: tuple[Kind, Any]) -> None:
        """A new "every …" is for the day, until other times are chosen. A number was meant for its own unit: "1 hour"
        must not become "every minute"."""
        kind, which = key
        draft = replace(self._draft, kind=kind)
        if kind is Kind.MONTHLY:
            draft = replace(draft, by_weekday=which)
        elif kind is Kind.EVERY:
            if draft.unit is not which:
                draft = replace(draft, unit=which, every=BEGINS_AT[which])
            if self._draft.kind is not Kind.EVERY and self._draft.is_new:
                draft = replace(draft, at=DAY_BEGINS)
            if draft.until_time <= draft.at:
                draft = replace(draft, until_time=time(23, 59))
        self._change(draft)

    def toggle_day(self, day: str) -> None:
        days = self._draft.weekdays
        self.set(weekdays=tuple(d for d in days if d != day) if day in days else (*days, day))

    def step_every(self, direction: int) -> None:
        """Minutes by five from ten on, else one by one."""
        draft, number = self._draft, self._draft.every
        step = 5 if draft.unit is Unit.MINUTES and min(number, number + direction) >= 10 else 1
        self.set(every=min(max(number + step * direction, 1), MOST[draft.unit]))

    def step(self, field: str, direction: int) -> None:
        """To the next value of a number."""
        self.set(**{field: form_view.stepped(self._facts, self._draft, field, direction)})

    def choose_number(self, field: str, number: int) -> None:
        self.set(**{field: form_view.own(self._facts, self._draft, field, number)})

    def choose_also(self) -> None:
        self._shell.dialogs.choose_many(
            _("Also at"),
            form_view.also_options(self._draft),
            _("Set"),
            lambda hours: self.set(more_hours=tuple(hours)),
            selected=self._draft.more_hours,
        )

    def choose(self, field: str) -> None:
        """Pick the value of a field of the draft."""
        draft, facts = self._draft, self._facts
        title, options = {
            "mission_id": (_("Mission"), form_view.mission_options(facts, draft.target)),
            "target": (_("Robot"), of_groups.target_options(facts)),
            "nth": (_("Which one of the month"), form_view.nth_options()),
            "month_weekday": (_("Weekday"), form_view.weekday_options()),
        }[field]
        self._shell.dialogs.choose(
            title,
            options,
            or_fetch(
                self._shell,
                lambda key: self._change(
                    self._draft.aimed_at(key) if field == "target" else replace(self._draft, **{field: key})
                ),
            ),
            selected=getattr(draft, field),
            last=fetch_option() if field == "mission_id" else None,
        )
