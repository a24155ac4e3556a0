"""The part of the form that asks the robot for the chosen mission's parameters. Save waits for the answer, but not for
long."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty

from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common.parameters_view import fields_of, problems_of
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.form_core import FormCore

ROBOT_ANSWERS_WITHIN = 3.0  # s for which saving waits for the robot's answer

Asked = tuple[int | None, str, Mapping[str, Any]]  # robot, guid of the mission, and what the schedule gives it


class AsksRobot(FormCore):
    """Until the robot or another one answers, the parameters are those of the schedule."""

    saving = BooleanProperty(False)
    parameters = ListProperty()  # fields of the chosen mission
    problems = ObjectProperty({})  # by name of the parameter
    map = ObjectProperty(None, allownone=True)  # of the robot, if the mission needs a position

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._asked: tuple[MissionParameter, ...] = ()  # the mission's parameters
        self._asked_of: Asked | None = None  # None: the form has just been filled
        self._is_asking = self._saves_when_known = False
        self._wait_no_longer = Clock.create_trigger(lambda _dt: self._parameters_are_known(()), ROBOT_ANSWERS_WITHIN)

    def save(self, parameters: Mapping[str, Any] | None = None) -> None:
        raise NotImplementedError

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

    def _ask_parameters(self) -> None:
        """Of the chosen mission, once as long as the schedule has the same values for it."""
        if not self.is_open:
            return
        robot_id, mission, base = self._asked_robot(), self._facts.mission(self._draft.mission_id), self._draft.base
        wanted = (robot_id, mission.guid if mission is not None else "", base.parameters if base is not None else {})
        if wanted == self._asked_of:
            return
        self._asked_of = wanted
        self._is_asking, self.map = False, None
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
                lambda new: self._forecast_soon() if new else None,
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
            self._forecast_soon()  # it may not have the mission at all
            if any(parameter.is_position for parameter in found):
                self._learn_map(asked)
        self._parameters_are_known(found or ())

    def _learn_map(self, asked: Asked) -> None:
        """Known parameters at once; otherwise the robot is asked, once."""
        robot_id, maps = asked[0] or 0, self._services.maps
        status = self._services.snapshots.get(robot_id).status
        map_id = status.map_id if status is not None else None
        if not map_id:
            return
        self.map = maps.known(robot_id, map_id)
        if self.map is None and maps.is_due(robot_id, map_id):
            self._shell.background.run(
                lambda: maps.learn(robot_id, map_id),
                lambda found: setattr(self, "map", found) if asked == self._asked_of else None,
                lambda _problem: None,
                key=("scheduler", "map"),
                apart="maps",
            )

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


def _parameters_of(draft: Draft) -> tuple[MissionParameter, ...]:
    """Those that the schedule has a value for."""
    return tuple(
        MissionParameter(name, type="integer" if type(value) is int else "", default=value)
        for name, value in draft.parameters.items()
    )


def _written(value: Any) -> str:
    """As its field shows it."""
    return "" if value is None else str(value)
