"""A mission's parameters before it runs: all its fields, with its own Run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kivy.properties import ListProperty, ObjectProperty, StringProperty

from app.domain.robot import MissionParameter
from app.screens.common.parameters_view import Problems, fields_of, values_of
from app.screens.home.cards import NO_STATE
from app.widgets import load_kv
from app.widgets.dialogs import FormDialog


class RunDialog(FormDialog):
    """``on_run(values)``, values by the parameters' names. Its button has the words of Home's; while a field is empty
    it is disabled and names the field."""

    vm = ObjectProperty(NO_STATE, rebind=True)
    fields = ListProperty()
    problems = ObjectProperty({}, force_dispatch=True)  # by name of the parameter
    missing = StringProperty()

    __events__ = ("on_run",)

    def __init__(self, parameters: Sequence[MissionParameter], **kwargs: Any) -> None:
        load_kv("home/run_dialog")
        self._parameters = parameters
        super().__init__(fields=fields_of(parameters), **kwargs)

    def on_run(self, values: Mapping[str, Any]) -> None:
        """The button was pressed, and everything entered can be used."""

    def run(self, entered: Mapping[str, Any]) -> None:
        try:
            values = values_of(self._parameters, entered)
        except Problems as problems:
            self.problems = dict(problems.by_name)
            return
        self.dismiss()
        self.dispatch("on_run", values)
