import base64
import hashlib

import pytest

from app.domain.models import InvalidInput
from app.mir.credentials import Token, normalise_fingerprint
from tests.support.errors import raises, refuses

HEADER = (
    "Basic ZGlzdHJpYnV0b3I6NjJmMmYwZjFlZmYxMGQzMTUyYzk1ZjZmMDU5NjU3NmU0ODJiYjhlNDQ4MDY0MzNmNGNmOTI5NzkyODM0YjAxNA=="
)


def test_the_token_is_user_and_lower_case_hex_sha256_in_base64() -> None:
    token = Token.derive("distributor", "distributor")
    assert token.header == HEADER
    user, digest = base64.b64decode(token.header.removeprefix("Basic ")).decode().split(":")
    assert (user, digest) == ("distributor", hashlib.sha256(b"distributor").hexdigest())


def test_user_names_and_passwords_may_hold_any_other_character() -> None:
    pair = base64.b64decode(Token.derive("Käyttäjä 1", "p:ä€ ").header.removeprefix("Basic ")).decode()
    assert pair == "Käyttäjä 1:" + hashlib.sha256("p:ä€ ".encode()).hexdigest()


def test_a_stored_header_is_the_same_token() -> None:
    token = Token.derive("admin", "secret")
    assert Token.from_header(token.header) == token
    assert hash(Token.from_header(token.header)) == hash(token)
    assert token != Token.derive("admin", "Secret")
    assert token != token.header


def test_the_key_of_a_fleet_is_a_token_too() -> None:
    token = Token.of_key(" mir_abc-1 ")
    assert (token.header, Token.from_header(token.header)) == ("x-api-key mir_abc-1", token)
    assert not token.is_published_default


@pytest.mark.parametrize("key", ["", " ", "two words", "a\r\nX: y", "ä", "x" * 501])
def test_what_is_no_key_is_refused_without_showing_it(key: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        Token.of_key(key)
    assert key.strip() not in refused.value.text or not key.strip()


@pytest.mark.parametrize("token", [Token.derive("admin", "secret"), Token.of_key("mir_abc")])
def test_the_secret_shows_in_no_text(token: Token) -> None:
    for text in (repr(token), str(token), f"{token}", f"{token!r}", f"{[token]}"):
        assert text.strip("[]") == "Token()"
    assert not hasattr(token, "__dict__")


def test_an_empty_token_is_false() -> None:
    assert not Token.from_header("")
    assert Token.from_header("").header == ""
    assert Token.derive("a", "b")


@pytest.mark.parametrize("user", ["", "a:b"])
def test_a_user_name_without_colon_is_needed(user: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        Token.derive(user, "secret")
    assert refused.value.field == "username"
    assert "secret" not in refused.value.text


@pytest.mark.parametrize(
    "header", ["Bearer abc", "Basic", "Basic !!", "Basic YWJj", "Basic ä", "Basic YTpi\r\nX: y", "nonsense"]
)
def test_a_damaged_stored_header_is_refused_without_showing_it(header: str) -> None:
    with raises(InvalidInput, text="the stored credentials can't be read: enter the password again"):
        Token.from_header(header)


def test_published_defaults_are_known() -> None:
    assert Token.derive("Distributor", "distributor").is_published_default
    assert Token.derive("admin", "admin").is_published_default
    assert not Token.derive("distributor", "Distributor").is_published_default
    assert not Token().is_published_default


@pytest.mark.parametrize(
    "text",
    [
        "ab" * 32,
        "AB" * 32,
        ":".join(["aB"] * 32),
        "SHA256:" + "ab" * 32,
        "sha-256 = " + " ".join(["AB"] * 32),
        "  " + "ab" * 32 + "\n",
    ],
)
def test_fingerprints_are_taken_as_people_copy_them(text: str) -> None:
    assert normalise_fingerprint(text) == "ab" * 32


@pytest.mark.parametrize("text", ["", "ab" * 20, "ab" * 31 + "a", "xy" * 32, "ab" * 33])
def test_a_text_that_is_no_sha256_fingerprint_is_refused(text: str) -> None:
    with refuses("certificate_sha256"):
        normalise_fingerprint(text)
