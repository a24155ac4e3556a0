"""Where the report of a check-up is written: the robot's name is in the file's name, and is not a path."""

from __future__ import annotations

import pytest

from app.services.files.exports import DataFiles


@pytest.mark.parametrize(
    ("robot", "stem"),
    [
        ("Aino", "check-up-aino"),
        ("Hall 2 / R#1", "check-up-hall-2-r-1"),
        ("../../etc", "check-up-etc"),
        ("..", "check-up"),
        ("Täti", "check-up-täti"),
    ],
)
def test_both_files_lie_where_people_look_and_are_named_after_the_robot(container, tmp_path, robot, stem):
    documents = tmp_path / "Documents"
    documents.mkdir()
    files = DataFiles(container.db, container.catalogue, container.clock, documents)
    assert files.write_text("<p>", f"check-up {robot}", ".html") == documents / f"amr-scheduler-{stem}-2026-11-23.html"
    assert (
        files.write_text("<p>", f"check-up {robot}", ".html") == documents / f"amr-scheduler-{stem}-2026-11-23-2.html"
    )
    assert files.write_text("{}", f"check-up {robot}", ".json") == documents / f"amr-scheduler-{stem}-2026-11-23.json"
