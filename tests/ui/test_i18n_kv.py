"""kv follows the language and keeps no widget alive."""

from __future__ import annotations

import gc
import weakref

import pytest
from kivy.lang import Builder

from app.widgets.text import Txt
from app.widgets.tr import tr
from tests.support.finnish import write_finnish

KV = """
BoxLayout:
    count: 3
    Note:
        text: tr._("Save")
    Note:
        text: "{} · {}".format(tr.n_("{n} robot", "{n} robots", root.count).format(n=root.count), tr.p_("run", "Failed"))
"""


@pytest.fixture
def finnish(tmp_path):
    write_finnish(tmp_path)
    from app.i18n import translator

    return lambda: translator.use("fi", tmp_path)


def test_texts_change_at_once(ui, finnish):
    ui.show(Builder.load_string(KV))
    assert ui.texts() == ["Save", "3 robots · Failed"]
    finnish()
    ui.advance()
    assert ui.texts() == ["Tallenna", "3 robottia · Epäonnistui"]


def test_a_text_with_a_count_follows_both(ui, finnish):
    root = ui.show(Builder.load_string(KV))
    finnish()
    root.count = 1
    ui.advance()
    assert "1 robotti · Epäonnistui" in ui.texts()


def test_collected_widgets_are_forgotten(ui):
    for _n in range(5):  # what earlier tests left
        gc.collect()
    before = len(tr.get_property_observers("_"))
    roots = [Builder.load_string(KV) for _n in range(5)]
    assert len(tr.get_property_observers("_")) > before
    references = [weakref.ref(root) for root in roots]
    del roots
    for _n in range(5):
        ui.advance()
        gc.collect()
    assert [reference() for reference in references] == [None] * 5
    assert len(tr.get_property_observers("_")) == before


def test_python_texts_of_a_label_do_not_need_kv(ui, finnish):
    from app.i18n import _

    finnish()
    label = ui.show(Txt(text=_("Save"), fit=True))
    assert label.text == "Tallenna"
