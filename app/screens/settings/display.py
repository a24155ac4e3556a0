"""Settings, Display: theme, language, size of texts and targets, switched at once; and the PIN."""

from __future__ import annotations

from datetime import time
from typing import Any

from kivy.properties import BooleanProperty, ListProperty, StringProperty

from app.domain.models import FONT_SCALES
from app.i18n import _, languages
from app.screens.common import formats
from app.screens.common.pin_sheet import PinSheet
from app.screens.common.problems import sentence_of
from app.screens.settings.page import PageContext, ValuesPage
from app.screens.settings.view import keyboard_words, theme_names
from app.services.live.access import ADVISED, LONGEST, SHORTEST, is_easy_to_guess
from app.widgets.items import Option

NEVER = "never"


def hour(number: int) -> str:
    return formats.wall_time(time(number))


def hours() -> list[Option]:
    return [Option(number, hour(number)) for number in range(24)]


class DisplayPage(ValuesPage):
    themes = ListProperty()
    languages = ListProperty()
    font_scales = ListProperty()
    alarm_sound = BooleanProperty(False)
    has_sound = BooleanProperty(False)
    keyboards = ListProperty()
    dim_from = StringProperty()
    dim_until = StringProperty()
    has_pin = BooleanProperty(False)

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.languages = [(language, formats.language_name(language)) for language in languages()]

    def show(self) -> None:
        super().show()
        settings = self.settings
        self.themes, self.keyboards = list(theme_names().items()), list(keyboard_words().items())
        self.font_scales = [(percent, formats.percent(percent)) for percent in FONT_SCALES]
        loudspeaker = self.context.shell.loudspeaker
        self.has_sound = loudspeaker is not None and loudspeaker.exists
        self.alarm_sound = settings.alarm_sound and self.has_sound
        self.dim_from = _("Never") if settings.dim_from is None else hour(settings.dim_from)
        self.dim_until = hour(settings.dim_until)
        self.has_pin = self.context.services.access.is_set()

    def set(self, name: str, value: Any) -> None:
        """Its fields show no problems: a message does."""
        self.context.save(**{name: value})

    def pick_dim_from(self) -> None:
        """None, for never, can't be the key of an option."""
        begins = self.settings.dim_from
        self.context.shell.dialogs.choose(
            _("Dim the screen from"),
            [Option(NEVER, _("Never")), *hours()],
            lambda chosen: self.set("dim_from", None if chosen == NEVER else chosen),
            selected=NEVER if begins is None else begins,
        )

    def pick_dim_until(self) -> None:
        self.context.shell.dialogs.choose(
            _("Bright again from"),
            hours(),
            lambda chosen: self.set("dim_until", chosen),
            selected=self.settings.dim_until,
        )

    def set_alarm_sound(self, on: bool) -> None:
        """Play it when it is switched on."""
        self.set("alarm_sound", on)
        if on and self.context.shell.loudspeaker is not None:
            self.context.shell.loudspeaker.play()

    # ------------------------------------------------------------------ the PIN
    def ask_for_pin(self) -> None:
        """Twice, so that a typing error does not lock the user out."""
        access = self.context.services.access
        first = _("Choose {least} to {most} digits. {advised} or more are hard to guess").format(
            least=SHORTEST, most=LONGEST, advised=ADVISED
        )
        sheet = PinSheet(title=_("New PIN"), text=first)
        chosen: list[str] = []

        def entered(_sheet: PinSheet, pin: str) -> None:
            if not chosen:
                chosen.append(pin)
                if is_easy_to_guess(pin):
                    sheet.ask_again(
                        _("Easy to guess: one of the first that people try"),
                        _("Enter it again to use it anyway"),
                    )
                else:
                    sheet.ask_again(text=_("Enter it again"))
            elif chosen.pop() != pin:
                sheet.ask_again(_("The PINs don't match"), first)
            else:
                sheet.busy = True
                self.context.run(
                    lambda: access.set_pin(pin),
                    lambda _none: self._pin_set(sheet),
                    lambda problem: sheet.ask_again(sentence_of(problem), first),
                )

        sheet.bind(on_entered=entered)
        self.context.shell.sheets.over(sheet)

    def _pin_set(self, sheet: PinSheet) -> None:
        self.context.shell.sheets.close(sheet)
        self.context.say(_("From now on Settings asks for the PIN"), "lock-outline")
        self.context.refresh()

    def remove_pin(self) -> None:
        def removed(_was_set: bool) -> None:
            self.context.say(_("Settings is open to everyone"), "lock-open-outline")
            self.context.refresh()

        self.context.shell.sheets.ask(
            _("Remove the PIN?"),
            _("Everyone can change Settings then."),
            _("Remove PIN"),
            lambda: self.context.run(self.context.services.access.remove, removed),
            _("Keep"),
        )
