"""The core of the Scheduler's form: its draft, the forecast of it, and its texts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from typing import Any, Protocol
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ObjectProperty

from app.domain.models import InvalidInput, Overlap, Schedule
from app.screens.common.shell import Shell
from app.screens.scheduler import form_view
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices
from app.screens.scheduler.form_notes import Preview
from app.screens.scheduler.form_view import FormView
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


class FormCore(EventDispatcher):
    """``view`` is what is shown."""

    view = ObjectProperty(FormView(), rebind=True)
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
        self._refused: InvalidInput | None = None  # by the last attempt to save this draft
        self.more = _uses_more(self._draft)
        self.show()

    @property
    def draft(self) -> Draft:
        return self._draft

    @property
    def _is_stored(self) -> bool:
        """Whether it is an unchanged schedule; before the first reading its entered name is unknown."""
        draft = self._draft
        return draft.is_stored(self._facts.name(draft.base) if self._facts.robots else draft.name)

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

    def _fresh(self) -> Draft:
        robots = [robot for robot in self._facts.robots if robot.enabled] or list(self._facts.robots)
        selected = self._facts.settings.selected_robot_id
        robot_id = selected if any(robot.id == selected for robot in robots) else robots[0].id if robots else None
        return Draft.new(self._local_now(), self._facts.settings, robot_id, calendar=self._facts.calendar)

    def _local_now(self) -> datetime:
        return self._services.clock.now().astimezone(ZoneInfo(self._facts.settings.timezone))

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
