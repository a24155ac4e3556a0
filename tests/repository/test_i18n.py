"""Catalogues: read, compiled, extracted, checked; the language switched while others listen. No kivy."""

from __future__ import annotations

import pytest

from app.i18n import Translator, languages, translation
from tests import catalogues
from tests.support.finnish import FINNISH, write_finnish


@pytest.fixture
def locale_dir(tmp_path):
    return write_finnish(tmp_path / "locale")


@pytest.fixture
def translator() -> Translator:
    return Translator()


def entries(locale_dir) -> dict[str, tuple[str, ...]]:
    """Translations by their texts."""
    catalogue = catalogues.read(locale_dir / "fi" / "LC_MESSAGES" / "amr.po")
    return {catalogues.key_of(entry): catalogues.forms_of(entry) for entry in catalogue if entry.id}


def test_a_catalogue_is_compiled(locale_dir):
    texts = translation("fi", locale_dir)
    assert texts.gettext("Save") == "Tallenna"
    assert texts.ngettext("{n} robot", "{n} robots", 1) == "{n} robotti"
    assert texts.ngettext("{n} robot", "{n} robots", 3) == "{n} robottia"
    assert texts.pgettext("run", "Failed") == "Epäonnistui"
    assert texts.gettext('A text on two lines: "quoted"\n') == 'Kaksi riviä: "lainattu"\n'
    assert [texts.gettext(text) for text in ("Guessed", "Not yet", "Gone")] == ["Guessed", "Not yet", "Gone"]
    assert languages(locale_dir) == ["en", "fi"]


def test_a_compiled_file_that_is_outdated_is_found(locale_dir):
    assert catalogues.outdated(locale_dir) == []
    po = locale_dir / "fi" / "LC_MESSAGES" / "amr.po"
    po.write_text(FINNISH.replace("Tallenna", "Talleta"), encoding="utf-8")
    assert catalogues.outdated(locale_dir) == [po.with_suffix(".mo")]


def test_the_language_is_switched_for_all_who_listen(translator, locale_dir):
    heard: list[str] = []
    stop = translator.subscribe(lambda: heard.append(translator.gettext("Save")))
    translator.use("fi", locale_dir)
    translator.use("en", locale_dir)
    stop()
    translator.use("fi", locale_dir)
    assert heard == ["Tallenna", "Save"]
    assert translator.ngettext("{n} robot", "{n} robots", 2) == "{n} robottia"
    assert translator.pgettext("run", "Failed") == "Epäonnistui"


def test_an_unknown_language_speaks_english(translator, locale_dir):
    translator.use("xx", locale_dir)
    assert translator.gettext("Save") == "Save"
    assert languages(locale_dir) == ["en", "fi"]


def test_nothing_stays_nothing(translator, locale_dir):
    translator.use("fi", locale_dir)
    assert translator.gettext("") == ""  # gettext itself would answer with the header


# ---------------------------------------------------------------------- extraction
@pytest.fixture
def code(tmp_path):
    (tmp_path / "app").mkdir()
    (tmp_path / "kv").mkdir()
    (tmp_path / "app" / "home.py").write_text(
        '''
"""Not a text."""
from app.i18n import N_, _, ngettext, pgettext
WORDS = {1: N_("Later")}
def f(n, word):
    return _("Save"), ngettext("{n} robot", "{n} robots", n), pgettext("run", "Failed"), _(word), _(WORDS[1].lower())
'''.replace(", _(WORDS[1].lower())", ""),
        encoding="utf-8",
    )
    (tmp_path / "app" / "reasons.py").write_text(
        '''
"""Why it ended."""
TABLE = {"low": (("battery",), "Battery {battery} %"), "up": ((), "Went UP")}
def tell(code, translate):
    raise KeyError("Unknown code")
''',
        encoding="utf-8",
    )
    (tmp_path / "kv" / "home.kv").write_text(
        """
<Home>:
    Title:
        text: tr._("Home (all)") if root.x else tr._("Save")
    Note:
        text: tr.n_("{n} run", "{n} runs", root.n).format(n=root.n) + tr.p_("trigger", "Idle")
""",
        encoding="utf-8",
    )
    return tmp_path


def test_texts_are_found_in_python_and_kv(code):
    texts = catalogues.texts_of_code(code)
    assert set(texts) == {
        "Later",
        "Save",
        "{n} robot\0{n} robots",
        "run\x04Failed",
        "Battery {battery} %",
        "Went UP",
        "Home (all)",
        "{n} run\0{n} runs",
        "trigger\x04Idle",
    }
    assert texts["Save"].places == ["app/home.py:6", "kv/home.kv:4"]


def test_a_text_put_together_at_run_time_is_refused(code):
    (code / "app" / "bad.py").write_text('from app.i18n import _\nx = _("a" + "b")\n', encoding="utf-8")
    with pytest.raises(catalogues.NotConstant, match=r"bad\.py:2"):
        catalogues.texts_of_code(code)


def test_extracting_keeps_translations_and_drops_unused_texts(code, locale_dir):
    catalogues.extract(locale_dir, code)
    messages = entries(locale_dir)
    assert messages["Save"] == ("Tallenna",)
    assert messages["{n} robot\0{n} robots"] == ("{n} robotti", "{n} robottia")
    assert messages["run\x04Failed"] == ("Epäonnistui",)
    assert not any("quoted" in key for key in messages)
    assert 'msgid "Home (all)"' in (locale_dir / "amr.pot").read_text(encoding="utf-8")
    first = (locale_dir / "fi" / "LC_MESSAGES" / "amr.po").read_text(encoding="utf-8")
    catalogues.extract(locale_dir, code)
    assert (locale_dir / "fi" / "LC_MESSAGES" / "amr.po").read_text(encoding="utf-8") == first
