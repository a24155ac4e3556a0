"""Buttons that the ring goes round, and whether it is drawn."""

from __future__ import annotations

from kivy.core.window import Window

from app.widgets.buttons import CommandButton
from app.widgets.scrolling import ScrollPage


def page_of(*words: str, height: float = 64) -> ScrollPage:
    page = ScrollPage()
    for word in words:
        page.add_widget(CommandButton(text=word, height=height))
    return page


def ring_at() -> int:
    return len(Window.canvas.after.children)
