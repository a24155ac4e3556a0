"""The widgets."""
from pathlib import Path

KV_DIR = Path(__file__).resolve().parents[2] / "kv"
COMMON_KV = ("tokens", "components", "fields", "lists", "rows", "dialogs", "pickers", "snackbar", "frame")


def load_kv(*names: str) -> None:
    """Load ``kv/<name>.kv`` for each name that is not loaded yet."""
    from kivy.lang import Builder

    for name in names:
        path = str(KV_DIR / f"{name}.kv")
        if path not in Builder.files:
            Builder.load_file(path)


def load() -> None:
    """Register all widgets and load their kv; once per process, before the first screen."""
    from app.widgets import (  # noqa: F401  (kivy's Factory learns the classes)
        buttons,
        chart,
        charts,
        dialogs,
        display,
        fields,
        frame,
        lists,
        pickers,
        robot_map,
        rows,
        snackbar,
        surfaces,
        text,
        timeline,
    )

    load_kv(*(name for name in COMMON_KV if (KV_DIR / f"{name}.kv").exists()))
