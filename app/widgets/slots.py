"""A place in a layout for one widget or none. A widget that isn't shown doesn't exist: a hidden one would still take
touches, and 40 KB of memory for each text."""

from kivy.factory import Factory
from kivy.lang import Builder
from kivy.properties import ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.rest import rest


class SlotPart(BoxLayout):
    """The content of a slot; its kv may read from ``card``."""

    card = ObjectProperty(None, rebind=True, allownone=True)


class PartSlot(BoxLayout):
    """Holds a widget of the class named ``part``, built with ``card=card``; nothing if ``part`` is empty. As high as the widget."""

    part = StringProperty()
    card = ObjectProperty(None, allownone=True)

    def on_part(self, *_):
        wanted = self.part if self.card is not None else ""
        if [type(child).__name__ for child in self.children] == ([wanted] if wanted else []):
            for child in self.children:
                child.card = self.card
            return
        for child in self.children:  # otherwise it would follow its card until it is collected
            for widget in child.walk(restrict=True):
                Builder.unbind_widget(widget.uid)
            rest.after_pressing(child)
        self.clear_widgets()
        if wanted:
            self.add_widget(Factory.get(wanted)(card=self.card))

    on_card = on_part
