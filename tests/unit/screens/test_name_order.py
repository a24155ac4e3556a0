"""Names in the order in which people count."""

from __future__ import annotations

from app.domain.models import Robot
from app.screens.common.name_order import by_name


def test_names_follow_each_other_by_their_letters_and_numbers():
    robots = [Robot(name, "http://10.0.0.1") for name in ("Robot 10", "robot 2", "Aino", "7", "Robot 1b", "Robot 1")]
    assert [robot.name for robot in by_name(robots)] == ["7", "Aino", "Robot 1", "Robot 1b", "robot 2", "Robot 10"]


def test_foreign_digits_are_sorted_like_names():
    robots = [Robot(name, "http://10.0.0.1") for name in ("R²", "R١٠", "R2", "", "R")]
    assert [robot.name for robot in by_name(robots)][:2] == ["", "R"]
