"""Settings, About: versions, licences, where the data live."""
from __future__ import annotations

from datetime import datetime
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import ListProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app import NAME, __version__
from app.i18n import _
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.page import Desk, SettingsPage
from app.services.files.about import components
from app.widgets.lists import Row


class ComponentRow(Row, BoxLayout):
    """A library with its version and licence."""
    name = StringProperty()
    version = StringProperty()
    licence = StringProperty()


class AboutModel(EventDispatcher):
    name = StringProperty(NAME)
    version = StringProperty()
    python = StringProperty("–")
    kivy = StringProperty("–")
    kivymd = StringProperty("–")
    sqlite = StringProperty("–")
    directory = StringProperty()
    components = ListProperty()


class AboutPage(SettingsPage):
    def __init__(self, desk: Desk, **kwargs: Any) -> None:
        super().__init__(desk, AboutModel(directory=str(desk.files.data_directory)), **kwargs)
        found = components()
        versions = {component.name: component.version for component in found}
        self.vm.python, self.vm.sqlite = versions["Python"], versions["SQLite"]
        self.vm.kivy, self.vm.kivymd = versions.get("Kivy", "–"), versions.get("KivyMD", "–")
        self.vm.components = [{"key": component.name, "name": component.name, "version": component.version or "–",
                               "licence": component.licence} for component in found]

    def show(self, facts: SettingsFacts, now: datetime) -> None:
        self.vm.version = _("version {version}").format(version=__version__)
