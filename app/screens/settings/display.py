"""Settings, Display & language: theme, language, size of texts and targets, switched at once."""
from __future__ import annotations

from datetime import datetime
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, StringProperty

from app.domain.models import FONT_SCALES
from app.i18n import _, languages
from app.screens.common import formats
from app.screens.common.pin_dialog import PinDialog
from app.screens.common.problems import sentence_of
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.page import Desk, SettingsPage
from app.screens.settings.view import keyboard_words, language_name, theme_names
from app.services.live.access import LONGEST, SHORTEST


class DisplayModel(EventDispatcher):
    themes = ListProperty()
    theme = StringProperty("light")
    languages = ListProperty()
    language = StringProperty("en")
    font_scales = ListProperty()
    font_scale = NumericProperty(100)    # %
    gloves = BooleanProperty(False)
    keyboards = ListProperty()
    keyboard = StringProperty("auto")
    has_pin = BooleanProperty(False)


class DisplayPage(SettingsPage):
    def __init__(self, desk: Desk, **kwargs: Any) -> None:
        self._languages = [(language, language_name(language)) for language in languages()]
        super().__init__(desk, DisplayModel(), **kwargs)

    def show(self, facts: SettingsFacts, now: datetime) -> None:
        vm, settings = self.vm, facts.settings
        vm.themes = list(theme_names().items())
        vm.languages = self._languages
        vm.theme, vm.language = settings.theme, settings.language
        vm.font_scales = [(percent, formats.percent(percent)) for percent in FONT_SCALES]
        vm.font_scale, vm.gloves = settings.font_scale_percent, settings.gloves

        vm.keyboards = list(keyboard_words().items())
        vm.keyboard = settings.keyboard
        vm.has_pin = self.desk.container.access.is_set()

    # ------------------------------------------------------------------ the PIN
    def ask_for_pin(self) -> None:
        """Twice, so that a slip locks nobody out."""
        first = _("Choose {least} to {most} digits").format(least=SHORTEST, most=LONGEST)
        dialog = PinDialog(title=_("New PIN"), text=first)
        chosen: list[str] = []

        def entered(_dialog: PinDialog, pin: str) -> None:
            if not chosen:
                chosen.append(pin)
                dialog.ask_again(text=_("Enter it once more"))
            elif chosen.pop() != pin:
                dialog.ask_again(_("The two were different"), first)
            else:
                dialog.busy = True
                self.desk.work(lambda: self.desk.container.access.set_pin(pin), lambda _none: self._pin_set(dialog),
                               lambda problem: dialog.ask_again(sentence_of(problem), first))

        dialog.bind(on_entered=entered)
        self.desk.shell.dialogs.open(dialog)

    def _pin_set(self, dialog: PinDialog) -> None:
        dialog.busy = False
        dialog.dismiss()
        self.desk.say(_("From now on Settings asks for the PIN"), "lock-outline")
        self.desk.refresh()

    def remove_pin(self) -> None:
        def removed(_was_set: bool) -> None:
            self.desk.say(_("Settings is open to everybody"), "lock-open-outline")
            self.desk.refresh()
        self.desk.work(self.desk.container.access.remove, removed)

    def set(self, name: str, value: Any) -> None:
        self.desk.save(**{name: value})
