"""Events that a widget fires, and handlers of its own properties."""


class Fires:
    """Mixin of what fires ``__events__``: kivy wants a handler of each, and here those that do nothing need not be written."""

    def __init_subclass__(cls, **kwargs):
        super().__init_subclass__(**kwargs)
        for event in cls.__dict__.get("__events__", ()):
            if not hasattr(cls, event):
                setattr(cls, event, _nothing)


def _nothing(self, *_values):
    """Until something is bound to it, or a subclass has a handler."""


class Late:
    """Mixin of what has handlers that need all of the widget: a property with one (``on_data`` of ``data``) is set when
    that is there, as in kv, also if the constructor gets its value."""

    def __init__(self, **kwargs):
        late = {name: kwargs.pop(name) for name in [*kwargs] if hasattr(type(self), f"on_{name}")}
        super().__init__(**kwargs)
        for name, value in late.items():
            setattr(self, name, value)
