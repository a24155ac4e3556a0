"""The Scheduler's form: keeps the draft, asks for its forecast while it is edited, saves it. Its texts are made by form_view.py."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime
from typing import Any
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.properties import BooleanProperty

from app.domain.models import InvalidInput, Overlap, Schedule
from app.i18n import _
from app.screens.common.parameters_view import Problems, values_of
from app.screens.common.problems import sentence_of
from app.screens.common.shell import Shell
from app.screens.scheduler import form_view
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices
from app.screens.scheduler.form_fields import FormFields
from app.screens.scheduler.form_notes import Preview
from app.services.catalogue.preview import Forecast

AFTER_TYPING = 0.1  # s of rest before the forecast is asked for


class FormModel(FormFields):
    """``saved(schedule)`` is called when one is stored, and returns whether it reports this itself; ``seen(draft,
    forecast)`` whenever these have changed, with None while the form is closed."""

    is_open = BooleanProperty(False)
    more = BooleanProperty(False)  # the rarer fields are shown

    def __init__(
        self,
        services: SchedulerServices,
        shell: Shell,
        saved: Callable[[Schedule], bool],
        seen: Callable[[Draft | None, Forecast | None], object],
    ) -> None:
        super().__init__()
        self._services, self._shell, self._saved, self._seen = services, shell, saved, seen
        self._facts = SchedulerFacts()
        self._preview = Preview()
        self._forecast_later = Clock.create_trigger(lambda _dt: self.forecast(), AFTER_TYPING)
        self._draft = self._fresh()
        self.entry = self._draft.entry
        self._submitted: object = None  # the entry being written, as in the form
        self._written: dict[object, Schedule | None] = {}  # by entry: as it is stored; None: being written
        self._kept: dict[object, Draft] = {}  # by entry: what can be brought back
        self._empty: Draft | None = self._draft  # its first state; None: it was filled in
        self._offered: Draft | None = None  # as a finger on free time has begun it

    # ------------------------------------------------------------------ what is edited
    @property
    def draft(self) -> Draft:
        return self._draft

    @property
    def editing(self) -> int | None:
        """The schedule that is being edited."""
        return self._draft.base.id if self._draft.base else None

    @property
    def is_in_use(self) -> bool:
        """Whether something is in it that somebody works on."""
        return self._draft != self._empty

    def take(self, facts: SchedulerFacts) -> None:
        """Facts were read again. An untouched form follows their defaults; one being edited keeps what was entered. If
        nothing was entered, a deleted schedule leaves the form."""
        base, is_stored = self._draft.base, self._is_stored
        if facts.names_of_all != self._facts.names_of_all:
            self._refused = None  # it may be possible now
        self._facts = facts
        if not self.is_in_use:
            self._draft = self._empty = replace(self._fresh(), entry=self._draft.entry)
        elif is_stored and base is not None and facts.schedule(base.id) is None:
            self.clear()
        before, self._draft = self._draft, self._brought_up_to_date(self._draft)
        if self._draft != before:
            self._refused = None
        self._ask_parameters()
        self.forecast()

    def _brought_up_to_date(self, draft: Draft) -> Draft:
        """Saving makes a schedule again if it was deleted."""
        base, facts = draft.base or draft.lost, self._facts
        return (
            draft.brought_up_to_date(facts.schedule(base.id), facts.name)
            if base is not None and facts.robots
            else draft
        )

    def begin(self, draft: Draft | None = None) -> None:
        """Open with ``draft``, or empty. Other entries that aren't saved can be brought back."""
        self._wait_no_more()
        self._offer_back()
        self.is_open = True
        self._show_draft(draft)

    def close(self) -> None:
        """The cross: what was entered can be brought back."""
        self._wait_no_more()
        self._offer_back()
        self.clear()

    def _offer_back(self) -> None:
        if self._is_entered:
            said = _("{name}: not saved").format(name=form_view.called(self._facts, self._draft))
            self._keep(self._draft, said)

    def _keep(self, draft: Draft, said: str) -> None:
        """What was entered can still be brought back, by hand; what was entered last, if some of it was being saved."""
        draft = self._kept.setdefault(draft.entry, draft)
        self._shell.snackbars.undo(
            said, _("Undo"), lambda: self._shell.go("scheduler", back=draft), about=("draft", draft.entry)
        )

    @property
    def _is_entered(self) -> bool:
        """Whether the form has an entry that is neither stored nor being stored."""
        is_known = self._draft == self._offered or self._draft.entry is self._submitted or self._is_stored
        return self.is_in_use and not is_known

    @property
    def _is_stored(self) -> bool:
        """Whether it is an unchanged schedule; before the first reading its entered name is unknown."""
        draft = self._draft
        return draft.is_stored(self._facts.name(draft.base) if self._facts.robots else draft.name)

    def deleted(self, schedule: Schedule) -> None:
        """What was entered for it can still be brought back, by hand: perhaps the deletion is undone."""
        if self.editing == schedule.id:
            self.close()

    def clear(self) -> None:
        """Close it, and keep nothing."""
        self.is_open = False
        self._show_draft(None)

    def _show_draft(self, draft: Draft | None) -> None:
        self._forget_waiting()
        if draft is not None and self._kept.pop(draft.entry, None) is not None:
            self._shell.snackbars.end(("draft", draft.entry))
        if draft is not None and (written := self._written.get(draft.entry)) is not None and draft.base is None:
            draft = replace(draft, base=written, lost=None)
        self._draft = self._brought_up_to_date(draft) if draft is not None else self._fresh()
        self._empty = self._draft if draft is None else None
        self.entry, self.page = self._draft.entry, ""
        self.more = _uses_more(self._draft)
        self.saving = self._is_in_writing(self.entry)
        self._preview, self._asked_of, self._submitted = Preview(), None, None
        self._changed()

    def _is_in_writing(self, entry: object) -> bool:
        return entry in self._written and self._written[entry] is None

    def edit(self, schedule: Schedule) -> None:
        if not self.is_open or self.editing != schedule.id:
            self.begin(Draft.of(schedule, self._facts.name(schedule)))

    def duplicate(self, schedule: Schedule) -> None:
        self.begin(Draft.of(schedule).copy())

    def new(self) -> None:
        """An empty one begins with the choice of a mission."""
        self.begin()
        self.choose_mission()

    def begin_at(self, robot_id: int, at: datetime) -> None:
        """A new schedule of that robot at that instant; entries for another new one stay, unless that is being saved or
        is for a group."""
        self._wait_no_more()
        untouched = self._draft in (self._empty, self._offered)
        goes_on = self.is_open and self._draft.is_new and not self.saving and self._draft.group_id is None
        draft, show = (self._draft, self._show_draft) if goes_on else (self._fresh(), self.begin)
        local = at.astimezone(ZoneInfo(draft.timezone)).replace(tzinfo=None)
        offered = replace(draft.with_day(local.date()).aimed_at(robot_id), at=local.time())
        show(offered)
        self._offered = offered if untouched or not goes_on else None

    def show(self) -> None:
        """Build the texts again: time has passed, or the language was switched."""
        preview = Preview(problem=self._refused) if self._refused else self._preview
        self.view = form_view.present(self._facts, self._draft, preview, self._services.clock.now())
        self.more = self.more or self.view.wrong_field in form_view.UNDER_MORE
        shown = self.is_open and not self._is_stored
        self._seen(self._draft if shown else None, self._preview.forecast)

    def on_is_open(self, *_args: object) -> None:
        self.show()

    # ------------------------------------------------------------------ saving
    def save(self, parameters: Mapping[str, Any] | None = None) -> None:
        """``parameters``: the values in their fields, by name; None: those that were entered."""
        if self.saving or self.view.save_off:
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
        draft, schedule = self._draft, self._draft.schedule()
        self.saving, self._submitted = True, draft.entry
        self._written[draft.entry] = None
        self._shell.background.run(
            lambda: self._services.catalogue.save_schedule(schedule),
            lambda saved: self._is_saved(draft, saved),
            lambda problem: self._not_saved(draft, problem),
        )

    @property
    def _given(self) -> dict[str, Any]:
        """The values in the fields of the parameters."""
        return {**{field.name: field.default for field in self.parameters}, **self._draft.entered}

    def _is_saved(self, draft: Draft, schedule: Schedule) -> None:
        """``draft`` was saved; later entries, in the form or as a draft, are not."""
        new, name = draft.is_new, self._facts.called(schedule)
        is_same, is_left = self._has_ended(draft, schedule)
        self._facts = replace(
            self._facts, schedules=(*(each for each in self._facts.schedules if each.id != schedule.id), schedule)
        )
        if is_left:
            self.clear()
        elif is_same:
            self._draft = replace(self._draft, base=schedule, lost=None)
            self._changed()
        if not self._saved(schedule):
            self._shell.snackbars.show(
                _("{name} is planned").format(name=name) if new else _("{name} is changed").format(name=name),
                icon="calendar-check",
            )

    def _has_ended(self, draft: Draft, stored: Schedule | None) -> tuple[bool, bool]:
        """Saving, well or not. Whether the form still has that entry, and whether it is unchanged."""
        del self._written[draft.entry]
        if stored is not None:
            self._written[draft.entry] = stored
        is_same, is_left = draft.entry is self.entry, draft.entry is self.entry is self._submitted
        if is_same:
            self.saving, self._submitted = False, None
        return is_same, is_left

    def _not_saved(self, draft: Draft, problem: BaseException) -> None:
        is_same, is_left = self._has_ended(draft, None)
        if isinstance(problem, InvalidInput) and is_left and self._draft == draft:  # nor changed by a reading
            self._refused = problem
            self.show()
            return
        name = form_view.called(self._facts, draft)
        if is_same:
            self._shell.say_problem(problem, name)
        else:  # somebody is on with another one, in good faith
            self._keep(draft, _("{name}: {problem}").format(name=name, problem=sentence_of(problem)))

    # ------------------------------------------------------------------ inside
    def _fresh(self) -> Draft:
        robots = [robot for robot in self._facts.robots if robot.enabled] or list(self._facts.robots)
        selected = self._facts.settings.selected_robot_id
        robot_id = selected if any(robot.id == selected for robot in robots) else robots[0].id if robots else None
        return Draft.new(self._local_now(), self._facts.settings, robot_id, calendar=self._facts.calendar)

    def _local_now(self) -> datetime:
        return self._services.clock.now().astimezone(ZoneInfo(self._facts.settings.timezone))

    def _change(self, draft: Draft) -> None:
        if draft != self._draft:
            self._draft = (
                draft if draft.mission_id == self._draft.mission_id else replace(draft, parameters={}, entered={})
            )
            self._is_changed()
            self._changed()

    def _changed(self) -> None:
        self._refused = None
        self._preview = replace(self._preview, problem=None)
        self._ask_parameters()
        self.show()  # at once what needs no service
        self._forecast_soon()

    def leave(self) -> None:
        """Send the delayed request at once, as the screen may be closed before."""
        self._wait_no_more()
        if self._forecast_later.is_triggered:
            self._forecast_later.cancel()
            self.forecast()

    def _forecast_soon(self) -> None:
        self._forecast_later()

    def forecast(self) -> None:
        """Ask for the draft's next starts and warnings; only the newest request is answered."""
        draft = self._draft
        if not self.is_open:
            return
        try:
            schedule = draft.schedule()
        except InvalidInput:
            self._preview = Preview()
            self.show()
            return
        known = self._services.robot_missions.names(schedule.robot_id) if schedule.robot_id else {}
        self._shell.background.run(
            lambda: self._ask_forecast(schedule, known),
            lambda preview: self._take_preview(draft, preview),
            self._shell.say_problem,
            key=("scheduler", "forecast"),
        )

    def _ask_forecast(self, schedule: Schedule, known: Mapping[str, str]) -> Preview:
        try:
            return Preview(self._services.forecasts.of(schedule, known))
        except InvalidInput as problem:
            return Preview(Forecast(), problem)

    def _take_preview(self, draft: Draft, preview: Preview) -> None:
        if replace(draft, entered=self._draft.entered) == self._draft:
            self._preview = preview
            self.show()


def _uses_more(draft: Draft) -> bool:
    """Whether one of the less common fields is not at its default."""
    return bool(
        draft.last_day
        or draft.more_hours
        or draft.priority
        or draft.finish_by_minutes
        or draft.overlap is not Overlap.SKIP
        or not draft.respect_working_days
    )
