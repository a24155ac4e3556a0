"""The frame around all screens: rail or bar with the screens, top bar, banner when needed, body. Built once; the screens change in its
``body``."""

import math

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.properties import (
    BooleanProperty,
    ColorProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.relativelayout import RelativeLayout
from kivy.uix.screenmanager import NoTransition
from kivymd.uix.appbar import MDTopAppBar
from kivymd.uix.behaviors.state_layer_behavior import StateLayerBehavior
from kivymd.uix.navigationbar import MDNavigationBar, MDNavigationItem
from kivymd.uix.screen import MDScreen
from kivymd.uix.screenmanager import MDScreenManager

from app.widgets import finger
from app.widgets.children import refill
from app.widgets.dock import dock
from app.widgets.events import Fires
from app.widgets.menu import ESCAPE
from app.widgets.places import places
from app.widgets.rest import BY_ITSELF, rest
from app.widgets.surfaces import CLEAR, Surface, TonedSurface

STILL = 2.0  # s without a touch, after which no hand is at work; late starts begin 30 s after they are listed


class TopBar(Fires, MDTopAppBar):
    """The tabs of the present screen, or its title if it has none; the time; and the bell, which keeps its place. With
    ``can_go_back`` an arrow is in front of the tabs, and Esc does what it does. ``on_choose_tab(key)``, ``on_back``,
    ``on_list_alarms`` are taps.
    """

    title = StringProperty()
    tabs = ListProperty()
    tab = ObjectProperty(None, allownone=True)
    can_go_back = BooleanProperty(False)
    clock = StringProperty()
    clock_in_doubt = BooleanProperty(False)
    bell_icon = StringProperty("bell-outline")
    bell_count = StringProperty()
    free_left = NumericProperty(0)  # px: between these there is nothing to press
    free_right = NumericProperty(0)

    __events__ = ("on_choose_tab", "on_back", "on_list_alarms")

    def on_can_go_back(self, *_):
        (Window.bind if self.can_go_back else Window.unbind)(on_keyboard=self._key)

    def _key(self, _window, key, *_):
        if key != ESCAPE or dock.field is not None:
            return False
        self.dispatch("on_back")
        return True

    def on_free_left(self, *_):
        dock.free_left = self.free_left

    def on_free_right(self, *_):
        dock.free_right = self.free_right

    def add_widget(self, widget, *args, **kwargs):
        """At once: KivyMD puts title and buttons in their places a frame later."""
        return BoxLayout.add_widget(self, widget, *args, **kwargs)


class Banner(Fires, TonedSurface):
    """A strip below the top bar: one line, and one button (``on_solve``). Without a text it keeps its place as long as it ``has_room``."""

    icon = StringProperty()
    text = StringProperty()
    action = StringProperty()
    has_room = BooleanProperty(True)
    about = ObjectProperty(None, allownone=True)  # what its button does
    stands, still = True, BY_ITSELF
    meaning = property(lambda self: self.about)

    __events__ = ("on_solve",)

    def on_about(self, *_):
        places.changed()

    def on_has_room(self, *_):
        """A tap on the page may be on its way."""
        places.come(self, among_others=True)

    def press(self):
        """A second tap at once is the same."""
        places.come(self, among_others=True)
        self.dispatch("on_solve")


class NavIndicator(Surface):
    """The background of the icon, for the present screen and the one under a finger."""

    state_layer_color = ColorProperty(CLEAR)


class NavItem(StateLayerBehavior, MDNavigationItem):
    """One screen; the present one is ``active``, with a filled icon."""

    name = StringProperty()
    icon = StringProperty()
    icon_selected = StringProperty()
    text = StringProperty()

    def add_widget(self, widget, *args, **kwargs):
        """KivyMD takes icon and label only, below each other."""
        return RelativeLayout.add_widget(self, widget, *args, **kwargs)

    def on_active(self, *_):
        """The indicator is there at once; KivyMD's grows."""


class NavBar(MDNavigationBar):
    """``items`` = [(name, label, icon, icon when selected), …], with ``current`` marked; a tap fires
    ``on_switch_tabs(item, icon, label)``, even on the present one. ``upright`` it is a rail at the side."""

    items = ListProperty()
    current = StringProperty()
    upright = BooleanProperty(False)

    def set_active_item(self, item):
        """A tap. KivyMD marks the tapped item; here the navigator decides which is marked."""
        self.dispatch("on_switch_tabs", item, item.icon, item.text)

    def on_items(self, *_):
        items = refill(self, [name for name, *_rest in self.items], lambda name: NavItem(name=name))
        for item, (_name, label, icon, icon_selected) in zip(items, self.items, strict=True):
            item.text, item.icon, item.icon_selected = label, icon, icon_selected
        self.on_current()

    def on_current(self, *_):
        for item in self.children:
            item.active = item.name == self.current


class Cut(NoTransition):
    """The next screen in the place of the former one. Kivy's draws both for a frame, over each other."""

    def start(self, manager):
        super().start(manager)
        self.stop()
        self.screen_in.dispatch("on_enter")
        self.screen_out.dispatch("on_leave")


class Screens(MDScreenManager):
    """The screens; only the present one is shown. The next one appears at once: KivyMD's transition takes 0.7 s of
    processor time."""

    def __init__(self, **kwargs):
        super().__init__(transition=Cut(), **kwargs)

    def check_transition(self, *_):
        """KivyMD would put one of its own in the place of ours."""

    def clear_widgets(self, children=None, **kwargs):
        """Hidden ones first, else each would be shown in turn."""
        for screen in sorted(
            self.screens[:] if children is None else children, key=lambda screen: screen is self.current_screen
        ):
            self.remove_widget(screen)
        self.transition = Cut()  # the former one holds on to the screens that it has changed


class Frame(Fires, Surface):
    """The window's content: the bars ``ids.nav`` and ``ids.bar``, and screens, which go into the body. The present ``screen`` says which
    tabs are in the top bar. ``banner`` has text, icon, tone, action, act and about.

    A banner moves the page when it comes and goes, as room that is always kept would cost a tenth of a low window. So it moves only
    while no hand is at work: after a while without a touch, or with another screen. For a moment after
    the banner or another button in it has come, a tap was meant for what was there before, and presses nothing.
    """

    screen = ObjectProperty(None, allownone=True, rebind=True)
    tall = BooleanProperty(False)
    low = BooleanProperty(False)
    floor = NumericProperty(0)  # px, of the bar with the screens at the bottom
    banner = ObjectProperty(None, allownone=True, rebind=True)
    has_banner = BooleanProperty(False)  # room for it
    items = ListProperty()
    current = StringProperty()

    __events__ = ("on_go", "on_solve")

    def __init__(self, **kwargs):
        self._touched_at = -math.inf
        self._when_still = Clock.create_trigger(self._make_room, 1, interval=True)
        super().__init__(**kwargs)
        self.ids.body.fbind("current_screen", self.setter("screen"))

    def on_floor(self, *_):
        dock.floor = self.floor

    def _make_room(self, *_):
        """Or take it away; later where a hand is at work."""
        wanted = bool(self.banner and self.banner.text)
        if not finger.is_down() and Clock.get_time() - self._touched_at >= STILL:
            self.has_banner = wanted
        if self.has_banner == wanted:
            self._when_still.cancel()
        else:
            self._when_still()

    on_banner = _make_room

    def on_current(self, *_):
        """Another screen is where the finger was."""
        rest.after_moving()
        self.has_banner = bool(self.banner and self.banner.text)

    def on_touch_down(self, touch):
        self._touched_at = Clock.get_time()
        return super().on_touch_down(touch)

    def on_touch_up(self, touch):
        self._touched_at = Clock.get_time()
        return super().on_touch_up(touch)

    def add_widget(self, widget, *args, **kwargs):
        holder = self.ids.body if isinstance(widget, MDScreen) else super()
        return holder.add_widget(widget, *args, **kwargs)
