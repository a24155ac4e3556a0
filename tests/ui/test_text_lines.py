"""Where texts break and end: at most this many lines, and within a word only without a better place."""

from __future__ import annotations

import pytest
from kivy.core.text import Label as CoreLabel
from kivy.factory import Factory

from app.widgets.text import Txt
from tests.support.examples import at_night


def shown_lines(ui, text: str, width: float, **values) -> list[str]:
    """The lines of a body text that wide."""
    label: Txt = Factory.Body(text=text, **values)
    ui.show(label, (width, 20))
    assert label.text == text  # what is searched, copied and compared stays whole
    lines = ["".join(word.text for word in line.words) for line in label._label._cached_lines]
    assert label.lines == len(lines)
    assert label.texture_size[0] <= width
    return lines


@pytest.mark.parametrize(
    ("text", "width", "lines"),
    [
        ("https://127.0.0.1:18443", 160, ["https://127.0.0.1", ":18443"]),
        ("https://127.0.0.1:18443", 400, ["https://127.0.0.1:18443"]),
        ("see https://127.0.0.1:18443 now", 160, ["see https://127.0.0.1", ":18443 now"]),
        ("robot-7.line-2.factory.example.com:8443", 160, ["robot-7.line-2.factory.", "example.com:8443"]),
        ("/home/tablet/.local/share/backups", 160, ["/home/tablet/.local/", "share/backups"]),
        ("two words", 160, ["two words"]),
    ],
)
def test_an_address_or_a_path_breaks_at_its_seams(ui, text, width, lines):
    assert shown_lines(ui, text, width) == lines


@pytest.mark.parametrize(
    ("text", "width", "lines"),
    [
        ("asks robots every 30 s", 155, ["asks robots every", "30 s"]),
        ("under 30 % until it is charged", 70, ["under", "30 % until", "it is", "charged"]),
        ("12 slow trucks", 60, ["12 slow", "trucks"]),
    ],
)
def test_a_number_stays_with_its_unit(ui, text, width, lines):
    assert [line.replace("\N{NO-BREAK SPACE}", " ") for line in shown_lines(ui, text, width)] == lines
    assert [line.replace("\N{NO-BREAK SPACE}", " ") for line in shown_lines(ui, text, width, most_lines=4)] == lines


@pytest.mark.parametrize(
    ("text", "width", "lines"),
    [
        ("Start elsewhere …", 115, ["Start", "elsewhere …"]),
        ("Asking the robot … and on", 118, ["Asking the", "robot … and on"]),
    ],
)
def test_dots_stay_with_the_word_before_them(ui, text, width, lines):
    assert [line.replace("\N{NO-BREAK SPACE}", " ") for line in shown_lines(ui, text, width)] == lines
    assert [line.replace("\N{NO-BREAK SPACE}", " ") for line in shown_lines(ui, text, width, most_lines=4)] == lines


@pytest.mark.parametrize("most", [0, 2])
def test_a_word_that_is_a_little_too_wide_gets_smaller_letters(ui, most):
    assert shown_lines(ui, "Lisäasetukset", 95) == ["Lisäasetukset"]
    assert shown_lines(ui, "Muut lisäasetukset", 95, most_lines=most) == ["Muut", "lisäasetukset"]
    label = Factory.Body(text="Lisäasetukset")
    ui.show(label, (95, 20))
    small = label.height
    ui.show(label, (300, 20))
    assert label.height > small


def test_a_word_without_seams_breaks_anywhere(ui):
    lines = shown_lines(ui, "x" * 60, 160)
    assert "".join(lines) == "x" * 60
    assert len(lines) > 2


def test_too_many_lines_end_with_dots(ui):
    text = "The wheel motor of the robot needs service at once, and so does the other one. " * 20
    lines = shown_lines(ui, text, 300, most_lines=2)
    assert len(lines) == 2
    assert lines[0].startswith("The wheel motor")
    assert lines[1].endswith("…")
    assert text.startswith(" ".join(line.strip() for line in lines)[:-1])


def test_a_text_that_fits_has_no_dots(ui):
    assert shown_lines(ui, "Short", 300, most_lines=2) == ["Short"]


def test_a_text_that_fits_keeps_its_least_width(ui):
    label = Factory.Body(text="6", fit=True, least_width=60)
    ui.show(label)
    assert (label.width, label.lines) == (60, 1)
    label.text = "longer than it has to be"
    ui.advance()
    assert label.width > 60


def test_the_limit_can_change(ui):
    label = Factory.Body(text="word " * 100, most_lines=2)
    ui.show(label, (300, 20))
    label.most_lines = 3
    ui.advance()
    assert label.lines == 3
    label.text = "word"
    ui.advance()
    assert (label.lines, label.height) == (1, label.texture_size[1])


IDEOGRAPHS = "".join(map(chr, range(0x4E00, 0x4E00 + 500)))


@pytest.mark.parametrize(
    "text",
    [
        IDEOGRAPHS,
        "i" * 2000,
        "il. " * 500,
        "W" * 900,
        "word " * 300,
        "\u0301" * 400 + "a" * 300,
        "/data/" * 200,
        f"{'i' * 150} {'W' * 300}",
        "one\ntwo\nthree\nfour",
        "x" * 30,
    ],
    ids=lambda text: repr(text[:12]),
)
@pytest.mark.parametrize("most", [2, *at_night(1, 3)])
def test_the_visible_part_of_a_long_text_is_its_beginning(ui, text, most):
    whole, seen = shown_lines(ui, text, 150), shown_lines(ui, text, 150, most_lines=most)
    assert len(seen) == min(most, len(whole))
    assert seen[: most - 1] == whole[: len(seen)][: most - 1]
    if len(whole) > most:
        assert seen[-1].endswith("…")
        assert whole[most - 1].startswith(seen[-1].removesuffix("…").rstrip())


def test_the_hidden_part_of_a_long_text_is_not_measured(ui, monkeypatch):
    measured, measure = [], CoreLabel.get_extents
    monkeypatch.setattr(
        CoreLabel, "get_extents", lambda label, text: measured.append(len(text)) or measure(label, text)
    )
    shown_lines(ui, IDEOGRAPHS * 10, 150, most_lines=2)
    assert sum(measured) < 2000
