"""Any screen may be the first that is shown: its own imports register what its kv names, not those of another screen."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from app.widgets import KV_DIR, MODULES, WIDGETS_KV

ROOT = KV_DIR.parent


def classes(tree: ast.Module) -> set[str]:
    """By a statement, or made by a function as ``Note, NoteStrong = ...``."""
    assigned = [name for node in tree.body if isinstance(node, ast.Assign) for name in ast.walk(node.targets[0])]
    named = {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
    return named | {name.id for name in assigned if isinstance(name, ast.Name)}


NAMED = re.compile(r"^ +([A-Z]\w+):", re.M)
WIDGETS = [f"app.widgets.{name}" for name in MODULES]
PLACES = {
    "home/*": "app.screens.home.screen",
    "scheduler/*": "app.screens.scheduler.screen",
    "logs/*": "app.screens.logs.screen",
    "settings/*": "app.screens.settings.screen",
    "frame/alarms": "app.screens.frame.alarms",
    "frame/late_starts": "app.screens.frame.late_starts",
    "common/pin": "app.screens.common.pin_sheet",
    "rescue": "app.screens.rescue",
    "widgets/keyboard": "app.widgets.keyboard",
    **{f"widgets/{name}": WIDGETS[0] for name in WIDGETS_KV},
}


@pytest.fixture(scope="module")
def sources() -> dict[str, ast.Module]:
    """Of all modules, by their names."""
    return {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): ast.parse(path.read_text(encoding="utf-8"))
        for path in (ROOT / "app").rglob("*.py")
    }


def imported(sources: dict[str, ast.Module], *modules: str) -> set[str]:
    """These and what they import at once, not later in a function or for types only."""
    seen: set[str] = set()
    new = list(modules)
    while new:
        name = new.pop()
        if name in sources and name not in seen:
            seen.add(name)
            for node in sources[name].body:
                if isinstance(node, ast.ImportFrom) and node.module:
                    new += [node.module, *(f"{node.module}.{each.name}" for each in node.names)]
    return seen


@pytest.mark.parametrize("place", PLACES)
def test_the_classes_of_a_kv_file_are_registered_by_the_module_that_loads_it(sources, place):
    files = sorted(KV_DIR.glob(f"{place}.kv"))
    assert files
    ours = {name: classes(tree) for name, tree in sources.items()}
    known = set().union(*(ours[name] for name in imported(sources, *WIDGETS, PLACES[place])))
    for file in files:
        unknown = set().union(*ours.values()) & set(NAMED.findall(file.read_text(encoding="utf-8"))) - known
        assert not unknown, f"{file.relative_to(ROOT)}: {unknown}"


OBJECT_OF_KV = re.compile(r"^    (\w+): None$", re.M)


def test_nothing_is_shown_of_an_object_that_a_class_has_by_kv_alone():
    """Kivy follows the values of an object only where its property says ``rebind``, which kv can't."""
    found = []
    for file in KV_DIR.rglob("*.kv"):
        for rule in re.split(r"^(?=<)", file.read_text(encoding="utf-8"), flags=re.M):
            for name in set(OBJECT_OF_KV.findall(rule)) - {"size_hint_x", "size_hint_y"}:
                used = re.findall(rf"^ +(?!on_)\w+:.*\b(?:self|root)\.{name}\.\w+", rule, re.M)
                found += [f"{file.name}: {line.strip()}" for line in used]
    assert found == []


def test_every_kv_file_has_its_place():
    assert {file for place in PLACES for file in KV_DIR.glob(f"{place}.kv")} == set(Path(KV_DIR).rglob("*.kv"))
