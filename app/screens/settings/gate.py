"""Protects Settings by the PIN, if one is set. Home, Scheduler, Logs and alarms never ask for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kivy.clock import Clock
from kivy.core.window import Window

from app.domain.clock import Clock as AppClock
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.pin_sheet import PinSheet
from app.screens.common.shell import Shell
from app.services.live.access import Access, Verdict

BEHIND = "settings"
LEFT_ALONE_S = 120.0  # without a touch or key, until Settings closes


@dataclass(frozen=True)
class GateServices:
    """What the gate uses of the app."""

    access: Access
    clock: AppClock


class Gate:
    """The guard of the navigator. Settings stays open until another screen is chosen, or until two minutes without a
    touch."""

    Services = GateServices

    def __init__(self, services: GateServices, shell: Shell) -> None:
        self._access, self._clock, self._shell = services.access, services.clock, shell
        self._sheet: PinSheet | None = None
        self._proceed: Callable[[], object] = lambda: None
        self._used_at = 0.0
        self._signs = dict.fromkeys(("on_touch_down", "on_touch_up", "on_keyboard", "on_textinput"), self._used)
        self._tick = Clock.create_trigger(self._every_second, 1, interval=True)

    def start(self) -> None:
        self._shell.navigator.guard = self.passes
        self._shell.navigator.bind(current=self._used)
        Window.bind(**self._signs)
        self._tick()

    def stop(self) -> None:
        self._tick.cancel()
        self._shell.navigator.guard = None
        self._shell.navigator.unbind(current=self._used)
        Window.unbind(**self._signs)

    def passes(self, screen: str, proceed: Callable[[], object]) -> None:
        """Let pass at once, or after the right PIN."""
        if screen != BEHIND or self._shell.navigator.current == BEHIND or not self._access.is_set():
            proceed()
            return
        self._proceed = proceed
        if self._asking is None:
            self._sheet = sheet = PinSheet(title=_("Enter the PIN"))
            sheet.bind(on_entered=self._entered)
            self._shell.sheets.over(sheet)
            self._show_wait()

    @property
    def _asking(self) -> PinSheet | None:
        """Until it is closed."""
        return self._sheet if self._sheet is not None and self._shell.sheets.has(self._sheet) else None

    def _entered(self, sheet: PinSheet, pin: str) -> None:
        sheet.busy = True
        self._shell.background.run(lambda: self._access.check(pin), self._checked, self._failed)

    def _checked(self, verdict: Verdict) -> None:
        if (sheet := self._asking) is None:
            return
        if verdict.is_right:
            self._shell.sheets.close(sheet)
            self._used()
            self._proceed()
            return
        left = verdict.tries_left
        sheet.ask_again(ngettext("Wrong PIN, {n} try left", "Wrong PIN, {n} tries left", left).format(n=left))
        self._show_wait()

    def _failed(self, problem: BaseException) -> None:
        if (sheet := self._asking) is not None:
            sheet.ask_again()
        self._shell.say_problem(problem)

    # ------------------------------------------------------------------ time
    def _show_wait(self) -> None:
        """For how long no PIN is accepted."""
        sheet, wait_s = self._asking, self._access.wait_s()
        if sheet is None:
            return
        if wait_s > 0:
            sheet.text = _("Forgotten? The person in charge of this tablet can remove it.")
            sheet.problem = _("Too many wrong PINs: wait {time}").format(time=formats.duration(math.ceil(wait_s)))
        elif sheet.waiting:
            sheet.text = sheet.problem = ""
        sheet.waiting = wait_s > 0

    def _used(self, *_args: Any) -> None:
        """Something was touched or typed, or another screen is shown."""
        self._used_at = self._clock.monotonic()

    def _every_second(self, _dt: float) -> None:
        if (sheet := self._asking) is not None and not self._access.is_set():  # removed by command
            self._shell.sheets.close(sheet)
            self._proceed()
        self._show_wait()
        is_alone = self._clock.monotonic() - self._used_at >= LEFT_ALONE_S
        if is_alone and self._shell.navigator.current == BEHIND and self._access.is_set():
            self._shell.dialogs.close_all()
            self._shell.go("home")
