"""Settings, Display & language: theme and language, switched at once."""
from __future__ import annotations

from datetime import datetime
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import ListProperty, StringProperty

from app.i18n import languages
from app.screens.settings_facts import SettingsFacts
from app.screens.settings_page import Desk, SettingsPage
from app.screens.settings_view import language_name, theme_names


class DisplayModel(EventDispatcher):
    themes = ListProperty()
    theme = StringProperty("light")
    languages = ListProperty()
    language = StringProperty("en")


class DisplayPage(SettingsPage):
    def __init__(self, desk: Desk, **kwargs: Any) -> None:
        self._languages = [(language, language_name(language)) for language in languages()]
        super().__init__(desk, DisplayModel(), **kwargs)

    def show(self, facts: SettingsFacts, now: datetime) -> None:
        vm, settings = self.vm, facts.settings
        vm.themes = list(theme_names().items())
        vm.languages = self._languages
        vm.theme, vm.language = settings.theme, settings.language

    def set(self, name: str, value: str) -> None:
        self.desk.save(**{name: value})
