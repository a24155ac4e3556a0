"""Row classes: robots, queue items, planned starts, runs and options in a list.

``key`` identifies the row; the list fires ``on_action(key, action, *values)``. Actions: RobotChip "choose", QueueRow "cancel",
PlanRow and DoneRow none, OptionRow "choose".
"""

from kivy.properties import BooleanProperty, ListProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.lists import RecycledRow, Row
from app.widgets.surfaces import Toned, TonedTap
from app.widgets.tokens import late_color, tk


class RobotChip(Row, TonedTap):
    """One robot in the picker: state's icon and word, name, battery. A selected one is solid in high contrast."""

    name = StringProperty()
    word = StringProperty()
    icon = StringProperty()
    battery = StringProperty("–")
    battery_icon = StringProperty("battery-unknown")
    battery_tone = StringProperty("neutral")
    battery_fg = late_color((0, 0, 0, 1))
    icon_fg = late_color((0, 0, 0, 1))
    selected = BooleanProperty(False)
    small = BooleanProperty(False)  # where three have little room
    least = ListProperty([0, 0, 0, 0])  # px: width, and the rest next to the name, the word and the battery

    def retone(self, *_):
        super().retone()
        solid = self.selected and tk.strong
        self.battery_fg = tk.accent_on if solid else getattr(tk, self.battery_tone)
        self.icon_fg = tk.accent_on if solid else self.fg

    on_battery_tone = on_selected = retone

    def on_release(self):
        self.act("choose")


class SmallRobotChip(RobotChip):
    """The same, its icon next to the word."""

    def __init__(self, **kwargs):
        super().__init__(small=True, **kwargs)


class QueueRow(RecycledRow, BoxLayout):
    """An item of the robot's queue, in a LongList; without ``cancellable`` it has no cross."""

    icon = StringProperty()
    number = StringProperty()
    tone = StringProperty("neutral")
    loud = BooleanProperty(False)
    mission = StringProperty()
    origin = StringProperty()
    cancellable = BooleanProperty(True)

    __events__ = ("on_cancel",)

    def on_cancel(self):
        self.act("cancel")


class PlanRow(RecycledRow, BoxLayout):
    """A planned start: time, ``day`` unless it is today, mission, and in the note how soon; ``icon`` marks a blocked
    one."""

    icon = StringProperty()
    time = StringProperty()
    day = StringProperty()
    mission = StringProperty()
    note = StringProperty()


class DoneRow(RecycledRow, Toned, BoxLayout):
    """A run that is over, with its reason; only an ``abnormal`` one is coloured."""

    icon = StringProperty()
    mission = StringProperty()
    when = StringProperty()
    reason = StringProperty()
    abnormal = BooleanProperty(False)


class OptionRow(RecycledRow, TonedTap):
    """One option of a list to choose from; ``mark`` shows a box that can be ticked. The ``tone`` is the icon's."""

    icon = StringProperty()
    text = StringProperty()
    note = StringProperty()
    selected = BooleanProperty(False)
    mark = BooleanProperty(False)

    def on_release(self):
        self.act("choose")
