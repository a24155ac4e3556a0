"""Settings, About: versions, licences, the data directory."""

from __future__ import annotations

from kivy.properties import ListProperty, StringProperty

from app.screens.settings.page import PageContext, SettingsPage
from app.services.files.about import components
from app.widgets.items import Item


class AboutPage(SettingsPage):
    directory = StringProperty()
    components = ListProperty()

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.directory = str(context.services.files.data_directory)
        self.components = [
            Item(
                each.name,
                each.name,
                meta=" · ".join(filter(None, (each.version, each.licence))),
                opens=False,
                strong=False,
            )
            for each in components()
        ]
