"""Events that a widget fires."""


class Fires:
    """Mixin of what fires ``__events__``: kivy wants a handler of each, and here those that do nothing need not be written."""

    def __init_subclass__(cls, **kwargs):
        super().__init_subclass__(**kwargs)
        for event in cls.__dict__.get("__events__", ()):
            if not hasattr(cls, event):
                setattr(cls, event, _nothing)


def _nothing(self, *_values):
    """Until something is bound to it, or a subclass has a handler."""
