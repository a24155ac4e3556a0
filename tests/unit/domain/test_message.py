"""Messages: what goes in, what is rendered, and that nothing that was stored ever fails."""

from __future__ import annotations

import errno
import json
import sqlite3
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.command import quote
from app.database.errors import DatabaseDamaged, DatabaseUnavailable, translated
from app.domain.message import is_message, message, message_of, message_of_system, render
from app.domain.models import InvalidInput
from app.failures import BadInput
from app.i18n import translation
from app.mir.errors import AnotherRobot, Rejected, RobotError, TimedOut, Unreachable, Unreadable
from app.screens.common.problems import sentence_of, words_of

FINNISH = translation("fi").gettext
REFUSED = "{address} refused the connection. Is it switched on and its address right?"
X, Y = Path("/x"), Path("/x/y.db")
ERRORS = [
    Unreachable(code="refused", address="10.1.1.1"),
    Rejected(status=400, reason="no such mission {x}", address="10.1.1.1"),
    Unreadable(address="10.1.1.1", problem=message("an entry of {what}", what=message("the mission list"))),
    RobotError(),
    AnotherRobot(address="10.1.1.1", expected="1", found="2"),
    InvalidInput(
        "path",
        "{path} can't be written: {problem}",
        path=X,
        problem=message_of_system(OSError(errno.ENOSPC, "No space left on device")),
    ),
    DatabaseUnavailable("{path} is closed", path=Y),
    DatabaseDamaged(Y, message("its content is missing"), X / "damaged.db", X / "good.db"),
]


def test_a_sentence_is_plain_json_of_text_and_values():
    assert message(REFUSED, address="10.1.1.1", n=3, at=X, nothing=None) == {
        "msgid": REFUSED,
        "params": {"address": "10.1.1.1", "n": 3, "at": str(X), "nothing": None},
    }


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_the_text_of_an_error_survives_the_database(error):
    kept = message_of(error)
    assert is_message(kept)
    assert render(json.loads(json.dumps(kept, allow_nan=False))) == str(error)


def test_a_sentence_inside_another_is_translated_too():
    assert (
        render(message_of(ERRORS[2]), FINNISH)
        == "10.1.1.1 antoi vastauksen, jota ei voi lukea: tehtäväluettelo: yksi kohta"
    )
    assert render(message_of(ERRORS[5]), FINNISH) == f"{X}: kirjoittaminen ei onnistu: levy on täynnä"
    damaged = render(message_of(ERRORS[7]), FINNISH)
    assert damaged.startswith(
        f"Tietokanta {Y} on vioittunut (sen sisältö puuttuu), säilytetty nimellä {X / 'damaged.db'}, "
    )


def test_an_error_inside_another_is_kept_in_its_parts():
    outer = InvalidInput(
        "path", "the backup could not be made: {problem}", problem=DatabaseUnavailable("{path} is closed", path="/x")
    )
    assert outer.text == "the backup could not be made: /x is closed"
    assert render(outer.message, FINNISH) == "varmuuskopiota ei voitu tehdä: /x on suljettu"


def test_storage_errors_are_reported_in_the_language():
    full = sqlite3.OperationalError("database or disk is full")
    full.sqlite_errorcode = sqlite3.SQLITE_FULL
    problem = translated(full, X)
    assert str(problem) == f"The disk is full, so {X} can't be written: free some space"
    assert (
        render(message_of(problem), FINNISH) == f"Levy on täynnä, joten tiedostoa {X} ei voi kirjoittaa: vapauta tilaa"
    )
    assert sentence_of(problem) == str(problem)


def test_numbers_are_written_as_the_language_does():
    slow = TimedOut(address="10.1.1.1", seconds=7.5)
    assert str(slow) == "10.1.1.1 didn't answer within 7.5 s"
    assert "7,5 s" in render(json.loads(json.dumps(slow.message)), FINNISH)
    assert render(message("{minutes} and {seconds:.2f}", minutes=10.0, seconds=0.125), FINNISH) == "10 and 0,12"
    assert render(message("{n}", n=1.5e-7), FINNISH) == "1,5e-07"


def test_a_failed_command_is_reported_by_its_cause():
    failure = BadInput("The disk is full")
    failure.__cause__ = ERRORS[6]
    assert sentence_of(failure) == f"{Y} is closed"
    assert sentence_of(BadInput("given whole")) == "given whole"


def test_the_command_that_restores_can_be_copied():
    data, good = quote(str(Path("/my data"))), quote(str(Path("/my data/backups/good.db")))
    damaged = DatabaseDamaged(Path("/my data/y.db"), "malformed", None, Path("/my data/backups/good.db"))
    assert str(damaged).endswith(f"with: python main.py --data-dir {data} --restore-backup {good}")
    assert f"komennolla: python main.py --data-dir {data} " in render(damaged.message, FINNISH)
    assert str(DatabaseDamaged(Path("/my data/y.db"), "malformed")).endswith(
        f"with: python main.py --data-dir {data} --restore-backup FILE"
    )


def test_an_unknown_word_of_the_system_stays_as_it_is():
    assert message_of_system(OSError(5000, "Something odd")) == "Something odd"
    assert render(message_of_system(OSError(13, "Permission denied")), FINNISH) == "käyttöoikeus puuttuu"


def test_texts_from_outside_stay_as_they_are():
    assert words_of("no answer") == render("no answer", FINNISH) == "no answer"
    assert render(None) == ""
    assert words_of(
        message("there is no route to {address}. Is the tablet on the robots' network?", address="A")
    ).startswith("There is")


def test_a_missing_value_leaves_a_mark():
    assert render(message("{path} is closed")) == "? is closed"


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(["msgid", "params", "path", "x"]), inner),
    max_leaves=8,
)


@given(VALUES)
def test_nothing_that_was_stored_ever_fails(value):
    assert isinstance(render(value, lambda text: text.upper()), str)
