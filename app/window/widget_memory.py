"""Where the memory of widgets comes from: the C library's heap, every free page of which goes back to the system (``garbage.give_back``).

Python keeps small objects in arenas of 1 MiB, and one goes back only when nothing at all is alive in it. A widget is four hundred small
objects, so screens and dialogs that come and go make the peaks, and of each arena that a peak needed something lives on: resident memory
stays at the highest peak there ever was. The C library's heap is slower to ask, so that only what is made while a widget is built
comes from there.
"""
from __future__ import annotations

import contextlib
import ctypes
import sys
from collections.abc import Callable, Iterator
from typing import Any

from kivy.uix.widget import WidgetMetaclass

RAW, MEM, OBJ = range(3)     # CPython's PYMEM_DOMAIN_…: the C library's heap, and the two that are served from arenas


class _Allocator(ctypes.Structure):
    """CPython's PyMemAllocatorEx."""
    _fields_ = [(name, ctypes.c_void_p) for name in ("ctx", "malloc", "calloc", "realloc", "free")]


@contextlib.contextmanager
def from_heap() -> Iterator[None]:
    """For as long as the block lasts, where Python and the C library are such that it can be done and helps."""
    calls = _allocators()
    if calls is None:
        yield
        return
    WidgetMetaclass.__call__ = _building(*calls)
    try:
        yield
    finally:
        del WidgetMetaclass.__call__


def _building(begin: Callable[[], object], end: Callable[[], object]) -> Callable[..., Any]:
    """A ``__call__`` of the class of widgets' classes, which asks the heap while the outermost of them is being built, on the UI thread."""
    make, building = type.__call__, False

    def call(cls: type, *args: Any, **kwargs: Any) -> Any:
        nonlocal building
        if building:
            return make(cls, *args, **kwargs)
        building = True
        begin()
        try:
            return make(cls, *args, **kwargs)
        finally:
            end()
            building = False

    return call


def _allocators() -> tuple[Callable[[], object], Callable[[], object]] | None:
    """Two calls: memory comes from the heap from now on; from arenas again.

    Either way it is freed by what frees Python's own: CPython asks the C library for whatever is too large for arenas, so that this knows
    of each piece where it came from. None for a Python that asks the C library anyway, or keeps account (``-X dev``, tracemalloc), and
    where the heap gives nothing back.
    """
    if sys.platform != "linux" or sys.implementation.name != "cpython" or not hasattr(ctypes.CDLL(None), "malloc_trim"):
        return None
    present = {domain: _Allocator() for domain in (RAW, MEM, OBJ)}
    for domain, allocator in present.items():
        ctypes.pythonapi.PyMem_GetAllocator(domain, ctypes.byref(allocator))
    raw = present.pop(RAW)
    if any(allocator.ctx is not None or allocator.malloc == raw.malloc for allocator in present.values()):
        return None
    heap = {domain: _Allocator(None, raw.malloc, raw.calloc, own.realloc, own.free) for domain, own in present.items()}
    change = ctypes.pythonapi.PyMem_SetAllocator

    def use(allocators: dict[int, _Allocator]) -> Callable[[], object]:
        pairs = [(ctypes.c_int(domain), ctypes.byref(allocator)) for domain, allocator in allocators.items()]

        def do() -> None:
            for pair in pairs:
                change(*pair)

        return do

    return use(heap), use(present)
