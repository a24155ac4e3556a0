"""``tr``: the translator for kv. ``text: tr._("Save")`` follows a change of the language."""

from kivy.event import EventDispatcher
from kivy.properties import ObjectProperty

from app.i18n import Translator, translator


class KvTranslator(EventDispatcher):
    """Its functions are properties, so kv computes what has called one again when the language changes."""

    _ = ObjectProperty()
    n_ = ObjectProperty()
    p_ = ObjectProperty()

    def __init__(self, source: Translator) -> None:
        super().__init__(_=source.gettext, n_=source.ngettext, p_=source.pgettext)
        source.subscribe(self._switched)

    def _switched(self) -> None:
        for name in ("_", "n_", "p_"):
            self.property(name).dispatch(self)


tr = KvTranslator(translator)
