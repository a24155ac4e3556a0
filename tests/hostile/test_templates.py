"""Templates of a robot's texts that take long to be filled in: 5,000 items of a queue held the processor for 18 s, a status for 0.7 s."""

from __future__ import annotations

import json
import tracemalloc

from app.mir.texts import LONGEST_TEXT, MOST_FIELDS, resolve


def template(message: str, **args: object) -> str:
    return json.dumps({"message": message, "args": args})


def test_a_long_text_is_not_copied_hundreds_of_times():
    text = template("%(a)s" * 400, a="a word, " * 1900)
    tracemalloc.start()
    try:
        assert resolve(text).startswith("a word, a word, ")
        assert tracemalloc.get_traced_memory()[1] < 1 << 20  # 6 MiB before
    finally:
        tracemalloc.stop()


def test_only_so_many_fields_are_filled_in():
    assert (
        resolve(template("%(a)s" * 80, a=7))
        == ("7" * MOST_FIELDS + "%(a)s" * 80)[: MOST_FIELDS + 5 * (80 - MOST_FIELDS)]
    )


def test_a_secret_in_a_long_text_is_hidden_as_in_any():
    secret = "ab12" * 40
    for before in (100, LONGEST_TEXT - 30, LONGEST_TEXT, 4 * LONGEST_TEXT - 30):
        found = resolve(template("%(a)s%(a)s", a="x " * (before // 2) + secret + " y" * 3000))
        assert "ab12ab12" not in found
