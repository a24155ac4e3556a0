"""The catalogues that the app ships: complete, and read as a speaker of the language would write. No kivy."""

from __future__ import annotations

import re
from datetime import UTC, datetime, time

import pytest

from app.domain import reasons
from app.domain.execution import Reason, ReasonCode
from app.domain.message import render
from app.domain.models import Between, InvalidInput, Schedule, Settings
from app.i18n import DOMAIN, LOCALE_DIR, Translator, languages
from app.screens.common import formats
from app.services.catalogue.validation import one_time_on_working_day
from app.services.planning import sentences
from app.services.planning.working_days import WorkingCalendar
from tests import catalogues

TRANSLATED = languages()[1:]


def test_no_catalogue_has_a_finding():
    assert catalogues.problems() == []
    assert catalogues.outdated() == []


@pytest.mark.parametrize("language", TRANSLATED)
def test_no_entry_is_empty_or_fuzzy(language):
    entries = [*catalogues.read(LOCALE_DIR / language / "LC_MESSAGES" / f"{DOMAIN}.po")]
    assert len(entries) > 700
    assert [entry.id for entry in entries if entry.id and (entry.fuzzy or not all(catalogues.forms_of(entry)))] == []


def test_no_screen_shows_a_command_for_a_shell():
    """Those are for who starts the app by one, where its data can't be opened."""
    commands = {
        key: text.places
        for key, text in catalogues.texts_of_code().items()
        if re.search(r"(?<!\S)--[a-z]|main\.py|\{command\}|\buv run\b|\bsudo\b", key)
    }
    assert len(commands) > 2
    files = {place.split(":")[0] for places in commands.values() for place in places}
    assert files == {"app/database/connection.py", "app/database/errors.py"}


OLD_WORDS = re.compile(
    r"""\(s\) | Waits\ for\ an\ answer | Odottaa\ vastausta | Ajastin | Pidossa | Luvut | Rajat | [Mm]ikä\ tahansa | Ei\ yhteyttä
    | (?i:not\ a\ working\ day | no\ work\b | closed\ days? | ei\ työpäivä | suljet\w+\ päiv\w+) | Closed\b | Suljettu\b
    | \b(?i:executing | is\ told | put\ right | handed\ over | held | released | aborted | unreachable | disconnected | offline)\b
    | \b(?:guid | IP | IP-osoit\w+)\b""",
    re.VERBOSE,
)  # states have other words; the rest is of a robot's interface


def _shown(screens_only: bool) -> list[str]:
    """All texts and translations, or those that a screen names itself."""
    kept = {
        key
        for key, text in catalogues.texts_of_code().items()
        if not screens_only or any(place.startswith(("app/screens", "kv/")) for place in text.places)
    }
    return [
        form
        for language in TRANSLATED
        for entry in catalogues.read(LOCALE_DIR / language / "LC_MESSAGES" / f"{DOMAIN}.po")
        if catalogues.key_of(entry) in kept
        for form in (*(entry.id if isinstance(entry.id, tuple) else (entry.id,)), *catalogues.forms_of(entry))
    ]


def test_texts_of_the_screens_have_the_words_of_the_app():
    assert len(shown := _shown(screens_only=True)) > 1500
    assert [text for text in shown if OLD_WORDS.search(text)] == []


def test_every_text_is_one_sentence_after_the_other():
    assert len(shown := _shown(screens_only=False)) > 3000
    assert [text for text in shown if ";" in text] == []


@pytest.mark.parametrize(
    ("english", "finnish"), [(r"any of \{group\}", "jokin|jollakin"), (r"^Keep\b", "^pidä"), (r"^Hold\b", "est")]
)
def test_one_word_has_one_translation(english, finnish):
    entries = [
        (catalogues.key_of(entry), catalogues.forms_of(entry)[0])
        for entry in catalogues.read(LOCALE_DIR / "fi" / "LC_MESSAGES" / f"{DOMAIN}.po")
        if re.search(english, catalogues.key_of(entry), re.IGNORECASE)
    ]
    assert len(entries) > 2
    assert [entry for entry in entries if not re.search(finnish, entry[1], re.IGNORECASE)] == []


def test_every_language_has_a_name_and_its_own_way_to_write_dates():
    assert languages() == ["en", "fi"]
    assert formats.LANGUAGES.keys() == set(languages())
    assert [formats.language_name(language) for language in languages()] == ["English", "Suomi"]


def test_what_is_refused_and_what_robots_answer_is_extracted(tmp_path):
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "errors.py").write_text(
        """
SENTENCES: dict[str, str] = {"no_answer": "{address} doesn't answer"}
def demand(field, msgid):
    if not field:
        raise InvalidInput("name", "enter a name")
    raise InvalidInput(field, msgid)
""",
        encoding="utf-8",
    )
    assert set(catalogues.texts_of_code(tmp_path)) == {"{address} doesn't answer", "enter a name"}


@pytest.mark.parametrize("damage", ["missing", "unused", "placeholder", "fuzzy", "empty"])
def test_the_check_notices_every_kind_of_damage(tmp_path, damage):
    source = (LOCALE_DIR / "fi" / "LC_MESSAGES" / f"{DOMAIN}.po").read_text(encoding="utf-8")
    entry = 'msgid "{robot} on hold: its check-up is not over"\nmsgstr "{robot}: lähdöt estetty, tarkastus kesken"\n'
    assert entry in source
    damaged = {
        "missing": "",
        "unused": entry + '\nmsgid "Nobody says this"\nmsgstr "Kukaan ei sano"\n',
        "placeholder": entry.replace('"{robot}: ', '"{robotti}: '),
        "fuzzy": "#, fuzzy\n" + entry,
        "empty": entry.replace("{robot}: lähdöt estetty, tarkastus kesken", ""),
    }[damage]
    target = tmp_path / "fi" / "LC_MESSAGES"
    target.mkdir(parents=True)
    (target / f"{DOMAIN}.po").write_text(source.replace(entry, damaged), encoding="utf-8")
    word = {"unused": "unused", "placeholder": "other placeholders"}.get(damage, "missing")
    found = catalogues.problems(tmp_path)
    assert len(found) == 1
    assert found[0].startswith(f"fi: {word}")


# ---------------------------------------------------------------------- Finnish
@pytest.fixture
def finnish() -> Translator:
    translator = Translator()
    translator.use("fi")
    return translator


@pytest.mark.parametrize(("n", "text"), [(0, "0 tehtävää"), (1, "1 tehtävä"), (2, "2 tehtävää")])
def test_numbers_take_the_partitive(finnish, n, text):
    assert finnish.ngettext("{n} mission", "{n} missions", n).format(n=n) == text


@pytest.mark.parametrize(
    ("rule", "text"),
    [
        (None, "Kerran 23.11.2026 klo 06.30"),
        ("FREQ=DAILY;INTERVAL=2", "2 päivän välein klo 06.30"),
        ("FREQ=WEEKLY;BYDAY=MO,TU,WE,TH,FR", "Viikoittain ma–pe klo 06.30"),
        ("FREQ=MONTHLY;BYDAY=-1FR", "Joka kuukausi: viimeinen pe klo 06.30"),
        ("FREQ=YEARLY", "Joka vuosi: marraskuun 23. päivä klo 06.30"),
        ("FREQ=DAILY;UNTIL=20261231", "Joka päivä klo 06.30, 31.12.2026 asti"),
    ],
)
def test_a_schedule_reads_in_finnish(finnish, rule, text):
    schedule = Schedule("x", 1, 1, datetime(2026, 11, 23, 6, 30), "Europe/Helsinki", rule, respect_working_days=False)
    assert sentences.sentence(schedule, finnish.gettext) == text


def test_a_part_of_the_day_reads_in_finnish(finnish):
    schedule = Schedule(
        "x",
        1,
        1,
        datetime(2026, 11, 23, 6, 0),
        "Europe/Helsinki",
        "FREQ=HOURLY;INTERVAL=3",
        between=Between(time(6), time(18)),
    )
    assert sentences.sentence(schedule, finnish.gettext) == "3 tunnin välein klo 06.00–18.00, vain työpäivinä"


def test_a_reason_reads_in_finnish(finnish):
    reason = Reason(
        ReasonCode.BATTERY_LOW, {"battery": 17.0, "minimum": 20, "until": datetime(2026, 11, 23, 5, 0, tzinfo=UTC)}
    )
    assert reasons.sentence(reason, "Europe/Helsinki", finnish.gettext) == "Akku 17 % pysyi alle 20 %:n 07.00 asti"
    halves = Reason(ReasonCode.BATTERY_LOW, {**reason.details, "battery": 17.25, "minimum": 20.5})
    assert reasons.sentence(halves, "Europe/Helsinki", finnish.gettext) == "Akku 17,2 % pysyi alle 20,5 %:n 07.00 asti"


def test_a_date_without_its_schedule_reads_in_finnish(finnish):
    sunday = Schedule("x", 1, 1, datetime(2026, 11, 29, 6, 30), "Europe/Helsinki")
    with pytest.raises(InvalidInput) as refused:
        one_time_on_working_day(sunday, WorkingCalendar(Settings()))
    assert render(refused.value.message, finnish.gettext).startswith("2026-11-29 (sunnuntai) on vapaapäivä")
