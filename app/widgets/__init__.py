"""The app's own widgets, and how to use them. They depend on no service, and get all their texts from outside.

Call ``load()`` once before the first widget; then all kv knows the classes, the constants below, ``tk`` (the tokens) and ``tr`` (the
translator: ``tr._("Save")``). A screen's kv is loaded by its module: ``load_kv("home/screen")`` loads kv/home/screen.kv, once per process.

What there is and how to use it: docs/widgets.md.
"""

import importlib
from pathlib import Path

KV_DIR = Path(__file__).resolve().parents[2] / "kv"
MODULES = (
    "buttons",
    "chart",
    "charts",
    "choices",
    "menu",
    "display",
    "fields",
    "flow",
    "frame",
    "lanes",
    "list_row",
    "lists",
    "long_list",
    "month",
    "number_pad",
    "pickers",
    "robot_map",
    "scrolling",
    "sheet",
    "slots",
    "snackbar",
    "surfaces",
    "tabs",
    "text",
)  # that register classes in kivy's Factory
WIDGETS_KV = (
    "tokens",
    "components",
    "fields",
    "lists",
    "list_row",
    "menu",
    "month",
    "sheet",
    "choices",
    "pickers",
    "snackbar",
    "tabs",
    "frame",
    "slots",
    "flow",
)


def load_kv(*names: str) -> None:
    """Load ``kv/<name>.kv`` for each name that is not loaded yet."""
    from kivy.lang import Builder

    for name in names:
        path = str(KV_DIR / f"{name}.kv")
        if path not in Builder.files:
            Builder.load_file(path)


def load() -> None:
    """Cure KivyMD, register all widgets and load their kv; once per process, before the app is made."""
    from kivy.clock import Clock

    from app.widgets import fonts, kivymd_cures
    from app.widgets.rest import rest

    kivymd_cures.apply()
    fonts.apply()
    rest.watch()
    Clock.max_iteration = (
        60  # wrapped texts in columns that fit settle in up to 25 rounds; kivy stops, and logs it, at 20
    )
    for name in MODULES:
        importlib.import_module(f"app.widgets.{name}")
    load_kv(*(f"widgets/{name}" for name in WIDGETS_KV))
