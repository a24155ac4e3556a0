"""The Scheduler's form: keeps one draft, asks for its forecast while it is edited, saves it. Its texts are made by form_view.py."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime, time
from functools import partial
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ObjectProperty, StringProperty

from app.domain.models import WEEKDAYS, InvalidInput, Overlap, Schedule
from app.i18n import _
from app.screens.common import formats
from app.screens.common.missing_mission import fetch_option, or_fetch
from app.screens.common.problems import sentence_of
from app.screens.common.shell import Shell
from app.screens.scheduler import form_view, of_groups
from app.screens.scheduler.actions import about
from app.screens.scheduler.draft import BEGINS_AT, DAY_BEGINS, Draft, Kind
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices
from app.screens.scheduler.form_notes import Preview
from app.screens.scheduler.form_parameters import FormParameters
from app.screens.scheduler.form_view import FormView
from app.services.catalogue.preview import Forecast
from app.widgets.items import Option

if TYPE_CHECKING:
    from app.screens.scheduler.screen import SchedulerViewModel

AFTER_TYPING = 0.1  # s of rest before the forecast is asked for


class FormModel(EventDispatcher):
    """One draft, from its beginning until it is saved or given up: another one has a form of its own. A form that was put
    aside still saves, and can be brought back."""

    draft = ObjectProperty(rebind=True)
    view = ObjectProperty(FormView(), rebind=True)  # the draft in words
    parameters = ObjectProperty(None, rebind=True)  # FormParameters
    missing = StringProperty()  # which of the mission's values has to be given first
    is_open = BooleanProperty(False)
    more = BooleanProperty(False)  # the rarer fields are shown
    saving = ObjectProperty(None, allownone=True)  # the draft that is being saved

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
        self._refused: InvalidInput | None = None  # by the last attempt to save this draft
        self._forecast_later = Clock.create_trigger(lambda _dt: self.forecast(), AFTER_TYPING)
        self._proposes = draft is None
        self.draft = self._begun = draft or self._fresh()  # as it is, and before anything was entered
        self.parameters = FormParameters(services, shell, lambda: self.draft, self._forecast_later)
        self.parameters.bind(silent=lambda *_args: self.show())
        self.more = _uses_more(self.draft)
        self.show()

    # ------------------------------------------------------------------ what is edited
    @property
    def editing(self) -> int | None:
        """The schedule that is being edited."""
        return self.draft.base.id if self.is_open and self.draft.base else None

    def open(self) -> None:
        """Again or for the first time."""
        self.is_open = True
        self.parameters.forget()
        self._changed()

    def put_aside(self) -> None:
        """What was entered can be brought back."""
        if self.is_open and self.draft not in (self._begun, self.saving):
            self._offer_back(_("{name}: not saved").format(name=form_view.called(self._facts, self.draft)))
        self.is_open = False

    def _offer_back(self, said: str) -> None:
        schedule = self.draft.base
        self._shell.snackbars.undo(
            said,
            _("Undo"),
            lambda: self._shell.go("scheduler", form=self),
            about=("draft", schedule.id) if schedule is not None else self,
        )

    def take(self, facts: SchedulerFacts) -> None:
        """Facts were read again. A form without entries follows them: their defaults, or its schedule."""
        self._facts = facts
        if self.draft == self._begun and self._proposes:
            self.draft = self._begun = self._fresh()
        elif (
            self.draft == self._begun and self.draft.is_stored and (stored := self._stored()) not in (None, self.draft)
        ):
            self.draft = self._begun = stored
            self.parameters.forget()
            self.show()
        if self.is_open:
            self.parameters.ask(facts, again=True)
        self.forecast()

    def aim(self, robot_id: int, at: datetime) -> None:
        """A finger has chosen robot and time: that alone is no entry."""
        is_untouched = self.draft == self._begun
        local = at.astimezone(ZoneInfo(self.draft.timezone)).replace(tzinfo=None)
        self._change(replace(self.draft.with_day(local.date()).aimed_at(robot_id), at=local.time()))
        if is_untouched:
            self._begun, self._proposes = self.draft, False

    def _fresh(self) -> Draft:
        """For the selected robot, if it is switched on."""
        facts, selected = self._facts, self._facts.settings.selected_robot_id
        robots = sorted(facts.robots, key=lambda robot: (not robot.enabled, robot.id != selected))
        return Draft.new(self._local_now(), facts.settings, facts.calendar, robots[0].id if robots else None)

    def _stored(self) -> Draft | None:
        schedule = self._facts.schedule(self.editing)
        return None if schedule is None else Draft.of(schedule, self._facts.name(schedule))

    def _local_now(self) -> datetime:
        return self._services.clock.now().astimezone(ZoneInfo(self._facts.settings.timezone))

    def _change(self, draft: Draft) -> None:
        if draft != self.draft:
            is_same = draft.mission_id == self.draft.mission_id
            self.draft = draft if is_same else replace(draft, parameters={}, entered={})
            self._changed()

    def _changed(self) -> None:
        self._refused, self._preview = None, replace(self._preview, problem=None)
        self.parameters.ask(self._facts)
        self.show()  # at once what needs no service
        self._forecast_later()

    def enter(self, values: Mapping[str, Any]) -> None:
        """A parameter's field was changed: the values of all of them."""
        self.draft = replace(self.draft, entered=self.parameters.entered(values))
        self._refused = None
        self.show()

    # ------------------------------------------------------------------ what is shown
    def show(self) -> None:
        """Build the texts again."""
        preview = Preview(problem=self._refused) if self._refused else self._preview
        preview = replace(preview, silent=self.parameters.silent)
        self.view = form_view.present(self._facts, self.draft, preview, self._services.clock.now())
        self.more = self.more or self.view.wrong_field in form_view.UNDER_MORE
        if self._host.form is self:
            shown = self.is_open and not self.draft.is_stored
            self._host.show_draft(self.draft if shown else None, self._preview.forecast)

    def on_is_open(self, *_args: object) -> None:
        self.show()

    def retranslated(self) -> None:
        """The language may have been switched."""
        self.parameters.show()
        self.show()

    def forecast(self) -> None:
        """Ask for the draft's next starts and warnings; only the newest request is answered. If another screen is shown,
        the next reading asks."""
        if not (self.is_open and self._host.is_open):
            return
        draft, until = self.draft, self._host.shown_until
        self._shell.background.run(
            lambda: self._foresee(draft, until),
            lambda preview: self._take_preview(draft, preview),
            self._shell.say_problem,
            key=("scheduler", "forecast"),
        )

    def _foresee(self, draft: Draft, until: datetime) -> Preview:
        try:
            schedule = draft.schedule()
            known = self._services.robot_missions.names(schedule.robot_id or 0)
            return Preview(self._services.forecasts.of(schedule, known, until))
        except InvalidInput as problem:
            return Preview(Forecast(), problem)

    def _take_preview(self, draft: Draft, preview: Preview) -> None:
        if replace(draft, entered=self.draft.entered) == self.draft:
            self._preview = preview
            self.show()

    # ------------------------------------------------------------------ saving
    def save(self) -> None:
        if self.saving or self.view.why or self.parameters.asking or (values := self.parameters.values()) is None:
            return
        self.draft = replace(self.draft, parameters=values)
        draft, schedule, catalogue = self.draft, self.draft.schedule(), self._services.catalogue
        before = draft.base and replace(draft.base, name=self._begun.name)  # what was generated is no entry
        if schedule == before:
            self.is_open = False
            self._shell.snackbars.show(_("{name} is unchanged").format(name=form_view.called(self._facts, draft)))
            return
        self.saving = draft

        def work() -> tuple[Schedule, Callable[[], object]]:
            """Returns what undoes it too."""
            if before is None:
                added = catalogue.save_schedule(schedule)
                return added, partial(catalogue.remove_schedule, added.id)
            changed = catalogue.change_schedule(before, schedule)
            return changed.after, partial(catalogue.undo_change, changed)

        self._shell.background.run(
            work,
            lambda saved: self._is_saved(draft, *saved),
            lambda problem: self._not_saved(draft, problem),
        )

    def _is_saved(self, draft: Draft, schedule: Schedule, undo: Callable[[], object]) -> None:
        """Entries that were made since are not."""
        name, is_done = self._facts.called(schedule), self.draft == draft
        self.saving = None
        self._shell.snackbars.end(about(schedule.id))  # an Undo of what was there before
        self._shell.snackbars.end(("draft", schedule.id))  # what was entered for it before, and not saved
        is_said = self._host.saved(schedule, undo)
        self._begun, self.draft = replace(draft, base=schedule), replace(self.draft, base=schedule)
        if is_done:
            self.is_open = False
        else:
            self._changed()
        if not is_said:
            words = _("{name} is planned") if draft.is_new else _("{name} is changed")
            self._shell.offer_undo(
                words.format(name=name),
                undo,
                lambda: self._undone(draft, schedule),
                about=about(schedule.id),
            )

    def _undone(self, draft: Draft, schedule: Schedule) -> None:
        if draft.is_new and self._host.form.editing == schedule.id:  # opened again since
            self._host.form.put_aside()
        self._forecast_later()

    def _not_saved(self, draft: Draft, problem: BaseException) -> None:
        self.saving, name = None, form_view.called(self._facts, draft)
        if not self.is_open:  # somebody is on with another one, in good faith
            self._offer_back(_("{name}: {problem}").format(name=name, problem=sentence_of(problem)))
        elif isinstance(problem, InvalidInput) and self.draft == draft:
            self._refused = problem
            self.show()
        else:
            self._shell.say_problem(problem, name)

    # ------------------------------------------------------------------ its fields
    def set(self, **values: Any) -> None:
        """Change fields of the draft."""
        self._change(replace(self.draft, **values))

    def remedy(self, values: tuple[tuple[str, Any], ...]) -> None:
        """A note's button was pressed: fields, and their values."""
        changed = dict(values)
        day = changed.pop("day", None)
        self._change(replace(self.draft if day is None else self.draft.with_day(day), **changed))

    def choose_mission(self) -> None:
        if not form_view.mission_options(self._facts, self.draft.target):
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
            _("Day") if self.draft.kind is Kind.ONCE else _("First day"),
            self.draft.day,
            lambda day: self._change(self.draft.with_day(day)),
            today=today,
            first=min(today, self.draft.day),
        )

    def pick_last_day(self) -> None:
        self._shell.dialogs.pick_date(
            _("Last day"),
            self.draft.last_day or self.draft.day,
            lambda day: self.set(last_day=day),
            today=self._local_now().date(),
            first=self.draft.day,
        )

    def pick_time(self, field: str) -> None:
        self._shell.dialogs.pick_time(_("Time"), getattr(self.draft, field), lambda at: self.set(**{field: at}))

    # ------------------------------------------------------------------ the other fields
    def choose_kind(self, kind: str) -> None:
        """Of the rarer ones first that of so many minutes."""
        if kind == "more":
            self._repeat((Kind.OTHER, "") if self.draft.other_rule else form_view.REPEATS[0])
        else:
            self.set(kind=Kind(kind))

    def choose_repeats(self) -> None:
        options, selected = form_view.repeats_options(self.draft), form_view.repeats_of(self.draft)
        self._shell.dialogs.choose(_("Repeats"), options, self._repeat, selected=selected)

    def _repeat(self, key: tuple[Kind, Any]) -> None:
        """A new "every …" is for the day, until other times are chosen. A number was meant for its own unit: "1 hour"
        must not become "every minute"."""
        kind, which = key
        draft = replace(self.draft, kind=kind)
        if kind is Kind.MONTHLY:
            draft = replace(draft, by_weekday=which)
        elif kind is Kind.EVERY:
            if draft.unit is not which:
                draft = replace(draft, unit=which, every=BEGINS_AT[which])
            if self.draft.kind is not Kind.EVERY and self.draft.is_new:
                draft = replace(draft, at=DAY_BEGINS)
            if draft.until_time <= draft.at:
                draft = replace(draft, until_time=time(23, 59))
        self._change(draft)

    def toggle_day(self, day: str) -> None:
        days = self.draft.weekdays
        self.set(weekdays=tuple(d for d in days if d != day) if day in days else (*days, day))

    def choose_number(self, field: str, number: int) -> None:
        """None if it is as in Settings."""
        self.set(**{field: form_view.own(self._facts, self.draft, field, number)})

    def choose_also(self) -> None:
        self._shell.dialogs.choose_many(
            _("Also at"),
            form_view.also_options(self.draft),
            _("Set"),
            lambda hours: self.set(more_hours=tuple(hours)),
            selected=self.draft.more_hours,
        )

    def choose(self, field: str) -> None:
        """Pick the value of a field of the draft."""
        draft, facts = self.draft, self._facts
        title, options = {
            "mission_id": (_("Mission"), form_view.mission_options(facts, draft.target)),
            "target": (_("Robot"), of_groups.target_options(facts)),
            "nth": (_("Which one of the month"), form_view.nth_options()),
            "month_weekday": (_("Weekday"), list(map(Option, WEEKDAYS, formats.current().weekdays))),
        }[field]
        self._shell.dialogs.choose(
            title,
            options,
            or_fetch(
                self._shell,
                lambda key: self._change(
                    self.draft.aimed_at(key) if field == "target" else replace(self.draft, **{field: key})
                ),
            ),
            selected=getattr(draft, field),
            last=fetch_option() if field == "mission_id" else None,
        )


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
