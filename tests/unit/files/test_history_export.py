"""The execution history as CSV, to the letter of the contract."""

from __future__ import annotations

import codecs
import csv
import io
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from app.database.connection import Database
from app.database.execution_history import ExecutionFilter, ExecutionHistory
from app.database.executions import ExecutionRepository
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger
from app.services.files.history_export import write_history
from tests.support.clock import VirtualClock
from tests.support.examples import examples

NOON = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
HEADER = (
    "id,trigger,schedule,robot,mission,mission_guid,state,reason_code,reason,planned_at,created_at,submitted_at,started_at,ended_at,"
    "duration_s,attempts,queue_id,group,choice,starts,moved_from,taken_by"
)
PLAIN = Execution(
    Trigger.SCHEDULED,
    1,
    "Aino",
    "Deliver",
    "guid-1",
    NOON,
    NOON + timedelta(minutes=15),
    NOON,
    "token",
    "Europe/Helsinki",
    schedule_id=1,
    schedule="Morning",
)


@pytest.fixture
def db(tmp_path):
    db = Database.open(tmp_path / "data" / "a.db", clock=VirtualClock(), threaded=False, durable=False)
    yield db
    db.close()


def add(db, **values) -> Execution:
    number = sum(ExecutionHistory().counts(db.read(), ExecutionFilter()).values()) + 1
    row = replace(PLAIN, **{"token": f"token-{number}", "schedule_id": number, **values})
    return db.write(lambda c: ExecutionRepository().add_each_once(c, [row])[0])


def text_of(db, wanted: ExecutionFilter | None = None) -> str:
    file = io.StringIO(newline="")
    write_history(db.read(), file, wanted)
    return file.getvalue()


def cells(db) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text_of(db), newline="")))


def test_without_rows_there_is_the_header(db):
    assert text_of(db) == HEADER + "\r\n"


def test_for_excel_it_has_semicolons_and_a_byte_order_mark(db):
    add(db, state=State.COMPLETED, mission="Vie lavat; tyhjät, pesuun", robot="Äijä")
    plain, file = cells(db), io.StringIO(newline="")
    assert write_history(db.read(), file, for_excel=True) == 1
    content = file.getvalue().encode("utf-8")
    assert content.startswith(codecs.BOM_UTF8 + b"id;trigger;schedule;robot;mission;")
    assert list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline=""), delimiter=";")) == plain


def test_an_ended_row_in_full(db):
    add(
        db,
        state=State.FAILED,
        reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": "no way"}),
        submitted_at=NOON + timedelta(seconds=1.9),
        started_at=NOON + timedelta(seconds=20),
        ended_at=NOON + timedelta(minutes=3),
        duration_s=159.6,
        attempts=2,
        queue_id=77,
    )
    assert text_of(db).split("\r\n")[1] == (
        "1,scheduled,Morning,Aino,Deliver,guid-1,failed,robot_aborted,The robot ended it: no way,2026-11-23T14:00:00+02:00,"
        "2026-11-23T14:00:00+02:00,2026-11-23T14:00:01+02:00,2026-11-23T14:00:20+02:00,2026-11-23T14:03:00+02:00,160,2,77,,,1,,"
    )


def test_an_open_row_has_empty_cells_where_there_is_nothing_yet(db):
    add(db, trigger=Trigger.MANUAL, schedule="", timezone="UTC")
    assert text_of(db).split("\r\n")[1:] == [
        "1,manual,,Aino,Deliver,guid-1,waiting,,,2026-11-23T12:00:00+00:00,2026-11-23T12:00:00+00:00,,,,,0,,,,1,,",
        "",
    ]


def test_a_start_of_a_group_says_which_robot_and_why(db):
    add(db, robot_group="Hall 1", choice={"robots": [{"robot": "Aino"}, {"robot": "Sisu", "out": "silent"}]})
    add(db, robot_group="Hall 1", robot_id=None, robot="")
    assert [(row["robot"], row["group"], row["choice"]) for row in cells(db)] == [
        ("Aino", "Hall 1", "Aino: free now · Sisu: no answer"),
        ("", "Hall 1", ""),
    ]


def test_rows_are_oldest_first_each_in_its_own_zone(db):
    add(db, planned_at=NOON + timedelta(hours=1), timezone="Asia/Kolkata")
    add(db, planned_at=NOON - timedelta(days=120))
    assert [row["planned_at"] for row in cells(db)] == ["2026-07-26T15:00:00+03:00", "2026-11-23T18:30:00+05:30"]


def test_a_zone_that_is_not_known_any_more_is_reported_in_utc(db):
    add(db, timezone="Gone/Zone")
    assert cells(db)[0]["planned_at"] == "2026-11-23T12:00:00+00:00"


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", " =1+1", "＝1+1"])
def test_a_cell_never_runs_as_a_formula(db, text):
    add(db, schedule=text, robot=text, mission=text)
    [row] = cells(db)
    assert row["schedule"] == row["robot"] == row["mission"] == f"'{text}"


@pytest.mark.parametrize(
    "text",
    ["M;=cmd|'/C calc'!A0", "M; @SUM(1)", "M;;+1", "M\t=1", "M\n-1", "M\r\n=1", ";=1", 'M;"=1"', 'M";=1"', "M;＝1"],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_nor_where_the_spreadsheet_of_another_country_separates_cells(db, text, separator):
    add(
        db,
        schedule=text,
        robot=text,
        mission=text,
        state=State.FAILED,
        reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": text}),
    )
    for row in csv.reader(io.StringIO(text_of(db), newline=""), delimiter=separator):
        for cell in row:
            assert not cell.lstrip(' \t\r\n"').startswith(("=", "+", "-", "@", "＝")), row
    assert cells(db)[0]["mission"].replace("'", "") == text.replace("'", "")


def test_quotes_commas_and_other_letters_come_through(db):
    add(
        db,
        mission='Vie "Ä", 漢字 🤖',
        state=State.CANCELLED,
        reason=Reason(ReasonCode.ROBOT_REMOVED, {"robot": 'a,"b'}),
        ended_at=NOON,
    )
    assert '"Vie ""Ä"", 漢字 🤖"' in text_of(db)
    [row] = cells(db)
    assert (row["mission"], row["reason"]) == ('Vie "Ä", 漢字 🤖', 'Robot a,"b is switched off or was removed')


def test_only_what_is_filtered(db):
    add(db)
    add(db, robot="Bella", robot_id=2)
    file = io.StringIO(newline="")
    assert write_history(db.read(), file, ExecutionFilter(robot_ids=[2])) == 1
    assert "Bella" in file.getvalue()


TEXT = st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\x00"), max_size=30)


@examples(60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(schedule=TEXT, mission=TEXT, message=TEXT)
def test_it_stays_a_table_with_any_texts(db, schedule, mission, message):
    db.write(lambda c: c.execute("DELETE FROM executions"))
    reason = Reason(ReasonCode.ROBOT_ABORTED, {"message": message})
    add(db, schedule=schedule, mission=mission, state=State.FAILED, reason=reason, ended_at=NOON)
    text = text_of(db)
    text.encode()
    [row] = csv.DictReader(io.StringIO(text, newline=""))
    assert (row["schedule"].removeprefix("'"), row["mission"].removeprefix("'")) == (
        schedule.removeprefix("'"),
        mission.removeprefix("'"),
    )
    assert None not in row
    for cell in row.values():
        assert not cell.startswith(("=", "+", "-", "@", "\t", "\r"))
