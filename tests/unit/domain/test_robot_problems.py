"""A robot's errors in words: short, with the codes under which its manual has them."""

from __future__ import annotations

import pytest

from app.domain.message import render
from app.domain.robot import LONGEST_PROBLEMS, RobotProblem, problems_in_words


@pytest.mark.parametrize(
    ("problem", "words"),
    [
        (RobotProblem(701, "Left motor too hot"), "Left motor too hot (701)"),
        (RobotProblem(701, "", "Motors"), "Motors (701)"),
        (RobotProblem(701), "(701)"),
        (RobotProblem(None, "Left motor too hot"), "Left motor too hot"),
        (RobotProblem(), ""),
    ],
)
def test_an_error_is_shown_with_its_code(problem, words):
    assert problems_in_words([problem]) == words


def test_the_same_error_twice_is_shown_once_and_another_code_is_another_error():
    assert (
        problems_in_words([RobotProblem(1, "Hot"), RobotProblem(1, "Hot"), RobotProblem(2, "Hot")])
        == "Hot (1) · Hot (2)"
    )


def test_many_or_endless_errors_still_show_their_codes():
    assert (
        render(problems_in_words([RobotProblem(number, f"E{number}") for number in range(5)]))
        == "E0 (0) · E1 (1) · E2 (2) … and 2 more"
    )
    endless = problems_in_words([RobotProblem(701, "x" * 1000)])
    assert (len(endless), endless[-6:]) == (LONGEST_PROBLEMS, " (701)")
