"""Taking a calendar file in: what is stored and shown of the file itself."""

from __future__ import annotations

import os
from datetime import date

import pytest

from app.domain.models import InvalidInput
from tests.support.site import Site

DAY = b"BEGIN:VCALENDAR\r\nBEGIN:VEVENT\r\n%sDTSTART;VALUE=DATE:20270105\r\nEND:VEVENT\r\nEND:VCALENDAR\r\n"


@pytest.fixture
def files(tmp_path):
    site = Site(tmp_path / "data")
    yield site.container.calendar_files
    site.switch_off()


@pytest.mark.parametrize(
    ("name", "shown"),
    [(b"kes\xe4.ics", "kesä.ics"), ("kesä.ics".encode(), "kesä.ics"), (b"ty\xc3\xb6 kes\xe4.ics", "työ kesä.ics")],
)
@pytest.mark.parametrize("summary", [b"", b"SUMMARY:Stop\r\n"])
def test_the_name_of_a_file_is_stored_and_shown_as_text(files, tmp_path, name, shown, summary):
    path = os.fsencode(tmp_path) + b"/" + name
    with open(path, "wb") as file:
        file.write(DAY % summary)
    found = files.read(os.fsdecode(path))
    [day] = files.take(found.events)
    assert (found.name, day.source, day.first_day) == (shown, shown, date(2027, 1, 5))
    assert day.name == ("Stop" if summary else shown.removesuffix(".ics"))


def test_a_sentence_about_such_a_file_can_be_shown(files, tmp_path):
    with pytest.raises(InvalidInput) as refused:
        files.read(os.fsdecode(os.fsencode(tmp_path) + b"/kes\xe4.ics"))
    assert str(refused.value).encode().decode().endswith("kesä.ics")
