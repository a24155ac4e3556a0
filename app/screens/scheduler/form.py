"""The Scheduler's form: keeps one draft, asks for its forecast while it is edited, saves it. Its texts are made by form_view.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from typing import Any, Protocol
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


class Host(Protocol):
    """The Scheduler that shows a form."""

    form: Any  # the one that is shown

    @property
    def shown_until(self) -> datetime:
        """The end of what its plan shows."""

    def show_draft(self, draft: Draft | None, forecast: Forecast | None) -> None:
        """In the plan; None: the form is closed."""

    def saved(self, schedule: Schedule) -> bool:
        """One is stored. Returns whether the message about it is shown there."""


class FormModel(FormFields):
    """One draft, from its beginning until it is saved or given up: another one has a form of its own. A form that was put
    aside still saves, and can be brought back."""

    is_open = BooleanProperty(False)
    more = BooleanProperty(False)  # the rarer fields are shown

    def __init__(
        self,
        services: SchedulerServices,
        shell: Shell,
        host: Host,
        facts: SchedulerFacts,
        draft: Draft | None = None,
    ) -> None:
        super().__init__()
        self._services, self._shell, self._host, self._facts = services, shell, host, facts
        self._preview = Preview()
        self._forecast_later = Clock.create_trigger(lambda _dt: self.forecast(), AFTER_TYPING)
        self._draft = self._begun = draft or self._fresh()  # as it is, and before anything was entered
        self._proposes = draft is None
        self._submitted = False  # what is in it is being saved
        self.more = _uses_more(self._draft)
        self.show()

    # ------------------------------------------------------------------ what is edited
    @property
    def draft(self) -> Draft:
        return self._draft

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
        if self._is_entered:
            self._offer_back(_("{name}: not saved").format(name=form_view.called(self._facts, self._draft)))
        self.is_open = False

    def _offer_back(self, said: str) -> None:
        self._shell.snackbars.undo(
            said, _("Undo"), lambda: self._shell.go("scheduler", form=self), about=("draft", self)
        )

    def take(self, facts: SchedulerFacts) -> None:
        """Facts were read again. An untouched form follows their defaults; one being edited keeps what was entered. If
        nothing was entered, a deleted schedule closes it."""
        base, is_stored = self._draft.base, self._is_stored
        if facts.names_of_all != self._facts.names_of_all:
            self._refused = None  # it may be possible now
        self._facts = facts
        if self._proposes and self._draft == self._begun:
            self._draft = self._begun = self._fresh()
        elif is_stored and base is not None and facts.schedule(base.id) is None:
            self.is_open = False
        elif (base := base or self._draft.lost) is not None:
            before, self._draft = self._draft, self._draft.brought_up_to_date(facts.schedule(base.id), facts.name)
            self._refused = self._refused if self._draft == before else None
        self._ask_parameters()
        self.forecast()

    @property
    def _is_entered(self) -> bool:
        """Whether it has an entry that is neither stored nor being stored."""
        return self.is_open and not (self._draft == self._begun or self._submitted or self._is_stored)

    @property
    def _is_stored(self) -> bool:
        """Whether it is an unchanged schedule; before the first reading its entered name is unknown."""
        draft = self._draft
        return draft.is_stored(self._facts.name(draft.base) if self._facts.robots else draft.name)

    def aim(self, robot_id: int, at: datetime) -> None:
        """A finger has chosen robot and time: that alone is no entry."""
        is_untouched = self._draft == self._begun
        local = at.astimezone(ZoneInfo(self._draft.timezone)).replace(tzinfo=None)
        self._change(replace(self._draft.with_day(local.date()).aimed_at(robot_id), at=local.time()))
        if is_untouched:
            self._begun, self._proposes = self._draft, False

    def show(self) -> None:
        """Build the texts again: time has passed, or the language was switched."""
        preview = Preview(problem=self._refused) if self._refused else self._preview
        self.view = form_view.present(self._facts, self._draft, preview, self._services.clock.now())
        self.more = self.more or self.view.wrong_field in form_view.UNDER_MORE
        if self._host.form is self:
            shown = self.is_open and not self._is_stored
            self._host.show_draft(self._draft if shown else None, self._preview.forecast)

    def on_is_open(self, *_args: object) -> None:
        self.show()

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
        draft, schedule = self._draft, self._draft.schedule()
        self.saving = self._submitted = True
        self._shell.background.run(
            lambda: self._services.catalogue.save_schedule(schedule),
            lambda saved: self._is_saved(saved, is_new=draft.is_new),
            lambda problem: self._not_saved(draft, problem),
        )

    @property
    def _given(self) -> dict[str, Any]:
        """The values in the fields of the parameters."""
        return {**{field.name: field.default for field in self.parameters}, **self._draft.entered}

    def _is_saved(self, schedule: Schedule, *, is_new: bool) -> None:
        """Entries that were made since are not."""
        name, is_done = self._facts.called(schedule), self._submitted
        self.saving = self._submitted = False
        is_said = self._host.saved(schedule)
        self._draft = replace(self._draft, base=schedule, lost=None)
        if is_done:
            self.is_open = False
        else:
            self._changed()
        if not is_said:
            self._shell.snackbars.show(
                _("{name} is planned").format(name=name) if is_new else _("{name} is changed").format(name=name),
                icon="calendar-check",
            )

    def _not_saved(self, draft: Draft, problem: BaseException) -> None:
        is_unchanged = self._submitted and self._draft == draft  # neither by hand nor by a reading
        self.saving = self._submitted = False
        name = form_view.called(self._facts, draft)
        if not self.is_open:  # somebody is on with another one, in good faith
            self._offer_back(_("{name}: {problem}").format(name=name, problem=sentence_of(problem)))
        elif isinstance(problem, InvalidInput) and is_unchanged:
            self._refused = problem
            self.show()
        else:
            self._shell.say_problem(problem, name)

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
        """Another screen is shown: the next reading asks for the forecast."""
        self.wait_no_more()
        self._forecast_later.cancel()

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
        until = self._host.shown_until
        self._shell.background.run(
            lambda: self._ask_forecast(schedule, known, until),
            lambda preview: self._take_preview(draft, preview),
            self._shell.say_problem,
            key=("scheduler", "forecast"),
        )

    def _ask_forecast(self, schedule: Schedule, known: Mapping[str, str], until: datetime) -> Preview:
        try:
            return Preview(self._services.forecasts.of(schedule, known, until))
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
