"""Settings, About: versions, licences, the data directory."""

from __future__ import annotations

from kivy.event import EventDispatcher
from kivy.properties import ListProperty, StringProperty

from app import __version__
from app.i18n import _
from app.screens.settings.page import PageContext, SettingsPage
from app.services.files.about import components
from app.widgets.items import Item


class AboutModel(EventDispatcher):
    version = StringProperty()
    directory = StringProperty()
    components = ListProperty()


class AboutPage(SettingsPage):
    Model = AboutModel

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.vm.directory = str(context.services.files.data_directory)
        self.vm.components = [
            Item(
                each.name,
                each.name,
                meta=" · ".join(filter(None, (each.version, each.licence))),
                opens=False,
                strong=False,
            )
            for each in components()
        ]

    def show(self) -> None:
        self.vm.version = _("version {version}").format(version=__version__)
