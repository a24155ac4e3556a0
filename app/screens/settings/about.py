"""Settings, About: versions, licences, the data directory."""

from __future__ import annotations

from kivy.properties import StringProperty

from app.screens.settings.page import PageContext, SettingsPage
from app.services.files.about import components


class AboutPage(SettingsPage):
    directory = StringProperty()
    components = StringProperty()  # a line each

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.directory = str(context.services.files.data_directory)
        lines = ((each.name, each.version, each.licence) for each in components())
        self.components = "\n".join(" · ".join(filter(None, line)) for line in lines)
