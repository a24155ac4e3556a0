"""Each cure of app/window/compat.py: that it works, and that it is still needed. When the second kind fails, the cure can go."""
from __future__ import annotations

import inspect
import sys
from pathlib import Path

import kivymd
from kivymd.uix.behaviors import ripple_behavior
from kivymd.uix.card import MDCard

from app.window import compat


def test_the_workarounds_are_for_the_installed_version():
    assert kivymd.__version__ == compat.KIVYMD_VERSION


def test_a_card_makes_no_buffer_before_it_is_pressed(ui):
    card = MDCard(ripple_behavior=True, size_hint=(None, None), size=(200, 100))
    ui.show(card)
    assert card.fbo is None
    ui.press(card)(.05)
    assert card.fbo is not None
    assert tuple(card.fbo.size) == (200, 100)


def test_the_ripple_workaround_is_still_needed():
    """Mended upstream when ``init_fbos`` no longer makes a frame buffer of whatever size the widget has in ``__init__``."""
    source = Path(inspect.getsourcefile(ripple_behavior)).read_text(encoding="utf-8")
    body = source[source.index("def init_fbos"):]
    assert "Fbo(size=self.size" in body[:body.index("    def ", 10)]


def test_dialogs_of_kivymd_still_bind_through_ids():
    """As long as they do, they are never freed, and ours is needed."""
    kv = Path(kivymd.__file__).with_name("uix") / "dialog" / "dialog.kv"
    assert "root.ids." in kv.read_text(encoding="utf-8")


def test_time_pickers_of_kivymd_still_have_twelve_hours():
    source = (Path(kivymd.__file__).with_name("uix") / "pickers" / "timepicker" / "timepicker.py").read_text(encoding="utf-8")
    assert "\n# TODO: Implement 24h input.\n" in source


def test_nothing_pulls_in_cairo(ui):
    assert "cairo" not in sys.modules
