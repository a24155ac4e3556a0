"""``tr``: the translator for kv. ``text: tr._("Save")`` follows a change of the language and is unbound with its widget."""

from kivy.lang import Observable

from app.i18n import Translator, translator

_WATCHED = ("_", "n_", "p_")


class KvTranslator(Observable):
    """Notifies kv's bindings when the language changes. Kivy unbinds by the uid that ``fbind`` returns, so each binding has its own."""

    def __init__(self, source: Translator):
        super().__init__()
        self._source = source
        self._bound: dict[int, tuple] = {}
        self._last_uid = 0
        source.subscribe(self._switched)

    def _(self, message: str) -> str:
        return self._source.gettext(message)

    def n_(self, one: str, many: str, n: int) -> str:
        return self._source.ngettext(one, many, n)

    def p_(self, context: str, message: str) -> str:
        return self._source.pgettext(context, message)

    def fbind(self, name, func, *args, **kwargs):
        if name not in _WATCHED:
            return super().fbind(name, func, *args, **kwargs)
        self._last_uid += 1
        self._bound[self._last_uid] = func, args, kwargs
        return self._last_uid

    def funbind(self, name, func, *args, **kwargs):
        if name not in _WATCHED:
            super().funbind(name, func, *args, **kwargs)
            return
        for uid, bound in self._bound.items():
            if bound == (func, args, kwargs):
                del self._bound[uid]
                return

    def unbind_uid(self, name, uid):
        if name not in _WATCHED:
            super().unbind_uid(name, uid)
            return
        self._bound.pop(uid, None)

    @property
    def bound(self) -> int:
        """The number of kv expressions that are bound to the language."""
        return len(self._bound)

    def _switched(self) -> None:
        for func, args, kwargs in list(self._bound.values()):
            func(*args, None, None, **kwargs)


tr = KvTranslator(translator)
