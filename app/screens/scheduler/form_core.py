"""The core of the Scheduler's form: its draft, the forecast of it, its texts, and the values that the chosen mission needs. The robot is
asked for these; Save waits for the answer, but not for long."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty

from app.domain.models import InvalidInput, Overlap, Schedule
from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common.parameters_view import fields_of, problems_of
from app.screens.common.shell import Shell
from app.screens.scheduler import form_view
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices
from app.screens.scheduler.form_notes import Preview
from app.screens.scheduler.form_view import FormView
from app.services.catalogue.preview import Forecast

if TYPE_CHECKING:
    from app.screens.scheduler.screen import SchedulerViewModel

AFTER_TYPING = 0.1  # s of rest before the forecast is asked for
ROBOT_ANSWERS_WITHIN = 3.0  # s for which saving waits for the robot's answer

Asked = tuple[int | None, str, Mapping[str, Any]]  # robot, guid of the mission, and what the schedule gives it


class FormCore(EventDispatcher):
    """``view`` is what is shown. Until the robot or another one answers, the parameters are those of the schedule."""

    view = ObjectProperty(FormView(), rebind=True)
    is_open = BooleanProperty(False)
    more = BooleanProperty(False)  # the rarer fields are shown
    saving = BooleanProperty(False)
    parameters = ListProperty()  # fields of the chosen mission
    problems = ObjectProperty({})  # by name of the parameter

    def __init__(
        self,
        services: SchedulerServices,
        shell: Shell,
        host: SchedulerViewModel,
        facts: SchedulerFacts,
        draft: Draft | None = None,
    ) -> None:
        super().__init__()
        self._services, self._shell, self._host, self._facts = services, shell, host, facts
        self._preview = Preview()
        self._forecast_later = Clock.create_trigger(lambda _dt: self.forecast(), AFTER_TYPING)
        self._asked: tuple[MissionParameter, ...] = ()  # the mission's parameters
        self._asked_of: Asked | None = None  # None: the form has just been filled
        self._is_asking = self._saves_when_known = False
        self._wait_no_longer = Clock.create_trigger(lambda _dt: self._parameters_are_known(()), ROBOT_ANSWERS_WITHIN)
        self._draft = self._begun = draft or self._fresh()  # as it is, and before anything was entered
        self._proposes = draft is None
        self._submitted = False  # what is in it is being saved
        self._refused: InvalidInput | None = None  # by the last attempt to save this draft
        self.more = _uses_more(self._draft)
        self.show()

    def save(self, parameters: Mapping[str, Any] | None = None) -> None:
        raise NotImplementedError

    @property
    def draft(self) -> Draft:
        return self._draft

    def show(self) -> None:
        """Build the texts again: time has passed, or the language was switched."""
        preview = Preview(problem=self._refused) if self._refused else self._preview
        self.view = form_view.present(self._facts, self._draft, preview, self._services.clock.now())
        self.more = self.more or self.view.wrong_field in form_view.UNDER_MORE
        if self._host.form is self:
            shown = self.is_open and not self._draft.is_stored
            self._host.show_draft(self._draft if shown else None, self._preview.forecast)

    def on_is_open(self, *_args: object) -> None:
        self.show()

    def _fresh(self) -> Draft:
        robots = [robot for robot in self._facts.robots if robot.enabled] or list(self._facts.robots)
        selected = self._facts.settings.selected_robot_id
        robot_id = selected if any(robot.id == selected for robot in robots) else robots[0].id if robots else None
        return Draft.new(self._local_now(), self._facts.settings, robot_id, calendar=self._facts.calendar)

    def _local_now(self) -> datetime:
        return self._services.clock.now().astimezone(ZoneInfo(self._facts.settings.timezone))

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

    # ------------------------------------------------------------------ what is entered
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
        self._forecast_later()

    def enter(self, values: Mapping[str, Any]) -> None:
        """A parameter's field was changed: the values of all of them. Unchanged fields alone are not an entry."""
        defaults = {field.name: _written(field.default) for field in fields_of(self._asked)}
        self._draft = replace(
            self._draft,
            entered={name: value for name, value in values.items() if _written(value) != defaults.get(name)},
        )
        self._is_changed()
        self.show()

    def retranslated(self) -> None:
        """The language may have been switched."""
        self._take_parameters(self._asked)
        self.show()

    def _is_changed(self) -> None:
        """By hand: Save was pressed for something else."""
        self._submitted, self._refused = False, None
        self._wait_no_longer.cancel()
        if self._saves_when_known:
            self._saves_when_known = self.saving = False

    def _save_when_known(self) -> None:
        self.saving = self._saves_when_known = True
        self._wait_no_longer()

    def wait_no_more(self) -> None:
        """What waits to be saved is saved now, if it can be: in a moment it isn't in the form any more."""
        if self._saves_when_known:
            self._parameters_are_known(())

    # ------------------------------------------------------------------ what the robot is asked
    def _ask_parameters(self) -> None:
        """Of the chosen mission, once as long as the schedule has the same values for it."""
        if not self.is_open:
            return
        robot_id, mission, base = self._asked_robot(), self._facts.mission(self._draft.mission_id), self._draft.base
        wanted = (robot_id, mission.guid if mission is not None else "", base.parameters if base is not None else {})
        if wanted == self._asked_of:
            return
        self._asked_of = wanted
        self._is_asking = False
        self._take_parameters(_parameters_of(self._draft))
        if robot_id is None or mission is None:
            return
        self._is_asking = True
        self._learn_others(robot_id)

        def take(found: tuple[MissionParameter, ...]) -> None:
            self._shell.mission_names.take(mission.guid, found)
            self._robot_answered(wanted, found)

        self._shell.background.run(
            lambda: self._ask_robot(robot_id, mission.guid),
            take,
            lambda _problem: self._robot_answered(wanted, self._shell.mission_names.known.parameters.get(mission.guid)),
            key=("scheduler", "parameters"),
            apart="parameters",
        )

    def _asked_robot(self) -> int | None:
        """For a group, the first robot that is switched on: a mission's parameters are the same on all."""
        draft = self._draft
        if draft.group_id is None:
            return draft.robot_id
        return next((robot.id for robot in self._facts.members(draft.group_id) if robot.enabled), None)

    def _learn_others(self, robot_id: int) -> None:
        """For a group, its other robots are asked too: perhaps none has the mission."""
        others = [
            robot.id for robot in self._facts.members(self._draft.group_id) if robot.enabled and robot.id != robot_id
        ]
        if others:
            self._shell.background.run(
                lambda: sum(self._services.robot_missions.learn_names(other) for other in others),
                lambda new: self._forecast_later() if new else None,
                lambda _problem: None,
                key=("scheduler", "names"),
                apart="names",
            )

    def _ask_robot(self, robot_id: int, guid: str) -> tuple[MissionParameter, ...]:
        self._services.robot_missions.learn_names(robot_id)
        return tuple(self._services.robot_missions.parameters(robot_id, guid))

    def _robot_answered(self, asked: Asked, found: Sequence[MissionParameter] | None) -> None:
        """This or another robot has answered; None: none did. The form may show another mission now."""
        if asked != self._asked_of:
            return
        if found is not None:
            kept = self._draft.parameters
            self._take_parameters(
                tuple(replace(p, default=kept[p.name]) if p.name in kept else p for p in found)
                or _parameters_of(self._draft)
            )
            self._forecast_later()  # it may not have the mission at all
        self._parameters_are_known(found or ())

    def _parameters_are_known(self, found: Sequence[MissionParameter]) -> None:
        """Save now if it has waited for them; but not if fields have just appeared unseen."""
        self._wait_no_longer.cancel()
        self._is_asking, waits, self._saves_when_known = False, self._saves_when_known, False
        if not waits:
            return
        self.saving = False
        if found:
            self.problems = problems_of(found)
            self._shell.snackbars.show(_("The mission asks for values: enter them, then save"), icon="form-textbox")
        else:
            self.save()

    def _take_parameters(self, found: tuple[MissionParameter, ...]) -> None:
        self._asked = found
        self.problems = {}
        self.parameters = fields_of(found, self._draft.entered)


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


def _parameters_of(draft: Draft) -> tuple[MissionParameter, ...]:
    """Those that the schedule has a value for."""
    return tuple(
        MissionParameter(name, type="integer" if type(value) is int else "", default=value)
        for name, value in draft.parameters.items()
    )


def _written(value: Any) -> str:
    """As its field shows it."""
    return "" if value is None else str(value)
