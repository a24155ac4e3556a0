"""Settings, About: versions, licences, the data directory."""

from __future__ import annotations

from kivy.event import EventDispatcher
from kivy.properties import ListProperty, StringProperty

from app import NAME, __version__
from app.i18n import _
from app.screens.settings.page import PageContext, SettingsPage
from app.services.files.about import components
from app.widgets.items import Item


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
    Model = AboutModel

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        vm, found = self.vm, components()
        versions = {component.name: component.version for component in found}
        vm.python, vm.sqlite = versions["Python"], versions["SQLite"]
        vm.kivy, vm.kivymd = versions.get("Kivy", "–"), versions.get("KivyMD", "–")
        vm.directory = str(context.services.files.data_directory)
        vm.components = [
            Item(
                each.name,
                each.name,
                meta=" · ".join(filter(None, (each.version, each.licence))),
                opens=False,
                strong=False,
            )
            for each in found
        ]

    def show(self) -> None:
        self.vm.version = _("version {version}").format(version=__version__)
