import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.mir.texts import LONGEST_TEXT, clean, resolve


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        ("Waiting for new missions...", "Waiting for new missions..."),
        ("two\r\nlines\tand a tab", "two lines and a tab"),
        ("lone \ud800 surrogate", "lone  surrogate"),
        ("bell\x07 escape\x1b[31m nul\x00", "bell escape[31m nul"),
        ("right\u202eto left", "rightto left"),
        ("  around  ", "around"),
        *(
            (f"a{hidden}b", "ab")
            for hidden in (
                "\u00ad\u034f\u180e\u200c\u200d\u2062\u206a\u2800\u3164\ue000\ufff9\U0001bca0\U000e0041\U0010fffd"
            )
        ),
        *((joined, joined) for joined in ("\u0646\u0645\u06cc\u200c\u062e\u0648", "👩\u200d🔧")),
        ("Äänekoski 🚚 电", "Äänekoski 🚚 电"),
        ("heaped Z" + "\u0301" * 60 + "!", "heaped Z" + "\u0301" * 3 + "!"),
        (None, ""),
        (7, ""),
        (["x"], ""),
    ],
)
def test_texts_are_cleaned(raw: object, text: str) -> None:
    assert clean(raw) == text


def test_texts_are_bounded() -> None:
    assert clean("x" * 10_000) == "x" * (LONGEST_TEXT - 1) + "…"
    assert clean("x" * LONGEST_TEXT) == "x" * LONGEST_TEXT
    assert clean("abc", 2) == "a…"


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        (
            '{"message": "Failed to reach goal position \'%(position_name)s\'", "args": {"position_name": "Station 2"}}',
            "Failed to reach goal position 'Station 2'",
        ),
        (
            '{"message": "%(d)d of %(n)d, %(x).2f m, %(p)d%%", "args": {"d": 3, "n": 4, "x": 1.8049, "p": 50}}',
            "3 of 4, 1.80 m, 50%",
        ),
        (r"{\"message\": \"Failed to reach \'%(name)s\'\", \"args\": {\"name\": \"Dock\"}}", "Failed to reach 'Dock'"),
        (r'{"message": "Say \"%(word)s\"", "args": {"word": "hi"}}', 'Say "hi"'),
        ('{"message": "no arguments"}', "no arguments"),
        ('{"message": "%(missing)s stays", "args": {}}', "%(missing)s stays"),
        ('{"message": "%(n)d items", "args": {"n": "many"}}', "many items"),
        ('{"message": "%(x)s", "args": {"x": {"deep": 1}}}', "%(x)s"),
        ('{"message": "plain % sign", "args": {"x": 1}}', "plain % sign"),
        ('{"message": "%(x)s", "args": [1]}', "%(x)s"),
        ('{"message": 5}', '{"message": 5}'),
        ('{"message": broken', '{"message": broken'),
        ("{not json}", "{not json}"),
        ("message", "message"),
        (None, ""),
    ],
)
def test_templates_are_resolved_and_anything_else_is_left_raw(raw: object, text: str) -> None:
    assert resolve(raw) == text


def test_no_template_blows_a_text_up() -> None:
    assert resolve('{"message": "%(x)999999999d", "args": {"x": 1}}') == "%(x)999999999d"
    assert resolve('{"message": "%(x).999999999f", "args": {"x": 1}}') == "%(x).999999999f"
    assert len(resolve(json.dumps({"message": "%(x)99d" * 400, "args": {"x": 1}}))) <= LONGEST_TEXT
    assert resolve('{"message": "%(x)d", "args": {"x": 1' + "0" * 400 + "}}") == "%(x)d"
    assert resolve('{"message": "%(x).99f", "args": {"x": -1e308}}') == "%(x).99f"
    assert resolve('{"message": ' + "[" * 10_000).startswith('{"message": [[')


@given(
    st.text(), st.dictionaries(st.text(max_size=3), st.none() | st.booleans() | st.integers() | st.floats() | st.text())
)
def test_any_template_gives_a_clean_short_text(message: str, args: dict[str, object]) -> None:
    for raw in (json.dumps({"message": message, "args": args}), message):
        text = resolve(raw)
        assert len(text) <= LONGEST_TEXT
        text.encode()
        assert not any(ord(character) < 32 for character in text)
