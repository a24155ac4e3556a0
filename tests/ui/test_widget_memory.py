"""The memory of widgets that are gone goes back to the system, whatever was made beside them and lives on."""
from __future__ import annotations

import ctypes
import gc

import pytest
from kivy.uix.label import Label
from kivy.uix.widget import WidgetMetaclass

from app.window.garbage import give_back
from app.window.widget_memory import OBJ, _Allocator, from_heap
from tests.ui.monkey import resident

WIDGETS = 1_000              # 35 MB
LIVES_ON = 25                # widgets, after which something is made that lives on


class Refused(Exception):
    pass


class Strange(Label):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        raise Refused


def stays_of(ui, count: int) -> float:
    """MiB that stay resident of so many widgets that have gone."""
    gc.collect()
    give_back()
    before = resident()
    kept, widgets = [], []
    for n in range(count):
        widgets.append(Label(text=str(n)))
        if n % LIVES_ON == 0:
            kept.append([[str(size) * size] for size in range(1, 40)])       # of many sizes
    del widgets
    for _n in range(2):
        ui.advance(.1)                       # kivy's clock lets go of them, and then of what they followed
        gc.collect()
    give_back()
    assert len(kept) == count / LIVES_ON
    return resident() - before


def asked_for_objects() -> tuple[int, ...]:
    allocator = _Allocator()
    ctypes.pythonapi.PyMem_GetAllocator(OBJ, ctypes.byref(allocator))
    return allocator.malloc, allocator.calloc, allocator.realloc, allocator.free


def test_what_widgets_needed_goes_back_to_the_system(ui):
    with from_heap():
        stays_of(ui, 100)                        # what kivy makes once
        assert stays_of(ui, WIDGETS) < 8


def test_only_widgets_are_made_there(ui):
    before, during = asked_for_objects(), []

    class Asking(Label):
        def __init__(self, **kwargs):
            super().__init__(**kwargs)
            during.append(asked_for_objects())

    with from_heap():
        assert asked_for_objects() == before
        Asking()
        assert asked_for_objects() == before
    assert during[0][:2] != before[:2]
    assert during[0][2:] == before[2:]       # who frees knows both


def test_a_widget_that_raises_leaves_nothing_behind(ui):
    before = asked_for_objects()
    with from_heap():
        with pytest.raises(Refused):
            Strange()
        assert asked_for_objects() == before
        assert Label(text="next").text == "next"
    assert "__call__" not in vars(WidgetMetaclass)
    assert asked_for_objects() == before
