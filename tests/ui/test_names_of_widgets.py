"""Every widget registers itself with kivy by its bare name: of two with one name kv builds the one imported last."""

from __future__ import annotations

import importlib
import re
from collections import Counter
from pathlib import Path

from kivy.uix.widget import Widget

ROOT = Path(__file__).parents[2]


def own_widgets() -> set[type]:
    """All classes of the app's, imported or not."""
    for path in (ROOT / "app").rglob("*.py"):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        if module.startswith(("app.screens.", "app.widgets.", "app.window.")):
            importlib.import_module(module)
    found, todo = set(), [Widget]
    while todo:
        subclasses = todo.pop().__subclasses__()
        found.update(subclasses)
        todo += subclasses
    return {kind for kind in found if kind.__module__.startswith("app.")}


def test_a_name_that_kv_knows_means_one_class():
    names = Counter(kind.__name__ for kind in own_widgets())
    for path in (ROOT / "kv").rglob("*.kv"):
        names.update(re.findall(r"^<-?(\w+)@", path.read_text(encoding="utf-8"), re.MULTILINE))
    assert len(names) > 200
    assert {name: n for name, n in names.items() if n > 1} == {}
