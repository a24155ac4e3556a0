"""Days off and extra working days in the Scheduler's words and bars."""

from dataclasses import replace
from datetime import UTC, date, datetime, timedelta

from app.domain.models import DayException, Mission, Robot, Settings
from app.screens.scheduler import form_view
from app.screens.scheduler.draft import Draft, Kind
from app.screens.scheduler.facts import SchedulerFacts, Window
from app.screens.scheduler.form_notes import Preview
from app.screens.scheduler.timeline import timeline
from app.services.catalogue.preview import Concern, ConcernCode, Forecast
from app.services.planning.recurrence import Occurrence
from app.services.planning.working_days import WorkingCalendar

NOW = datetime(2026, 11, 19, 12, 38, tzinfo=UTC)  # Thursday, 14:38 in Helsinki
FRIDAY, SATURDAY = date(2026, 11, 20), date(2026, 11, 21)
SETTINGS = Settings(timezone="Europe/Helsinki")
AUDIT = DayException("Audit", FRIDAY, FRIDAY, id=1)
FAIR = DayException("Fair", SATURDAY, SATURDAY, is_working=True, id=2)
FACTS = SchedulerFacts(
    settings=SETTINGS,
    calendar=WorkingCalendar(SETTINGS, (AUDIT, FAIR)),
    robots=(Robot("Aino", "http://a", id=1),),
    missions=(Mission("Kits", "g", id=1),),
)


def draft(**values):
    return replace(Draft.new(NOW, SETTINGS, FACTS.calendar, 1), mission_id=1, **values)


def noted(*concerns):
    forecast = Forecast((Occurrence(NOW, NOW.replace(tzinfo=None)),), None, concerns)
    return tuple(row.text for row in form_view.present(FACTS, draft(kind=Kind.DAILY), Preview(forecast), NOW).notes)


def test_the_timeline_hatches_a_closed_day_under_its_name():
    unfolded = Window(unfolded=frozenset({NOW + timedelta(days=1)}))
    audit = timeline(FACTS, NOW, unfolded).bands[-1]
    assert audit == (11.0, 35.0, "Audit: day off", "closed")
    assert timeline(FACTS, NOW).bands[0] == (11.0, 35.0, "Fri, day off", "folded")


def test_an_extra_working_day_is_not_hatched():
    assert timeline(FACTS, NOW + timedelta(days=2)).bands[0].text == "Sun, day off"


def test_a_new_schedule_begins_on_a_day_on_which_work_is_done():
    evening = NOW.replace(hour=23)
    assert Draft.new(evening, SETTINGS, WorkingCalendar(SETTINGS)).day == FRIDAY
    assert Draft.new(evening, SETTINGS, FACTS.calendar).day == SATURDAY


def test_a_one_time_start_on_a_closed_day_is_refused_at_the_day_with_its_name():
    shown = form_view.present(FACTS, draft(day=FRIDAY), Preview(Forecast()), NOW)
    assert shown.problem_at("day") == shown.why == "Day off: Audit"
    assert [[option.text for option in note.remedies] for note in shown.notes] == [["Sat 21 Nov", "Run anyway"]]


def test_warnings_name_the_days_that_are_omitted():
    one = Concern(ConcernCode.CLOSED_DAYS, details={"days": ((FRIDAY, "Audit"),)})
    assert noted(one) == ("Days off: Fri 20 Nov (Audit)",)
    three = Concern(ConcernCode.CLOSED_DAYS, details={"days": ((FRIDAY, "Audit"), (SATURDAY, "x"), (SATURDAY, "y"))})
    assert noted(three) == ("Days off: Fri 20 Nov (Audit), Sat 21 Nov, Sat 21 Nov",)
    first = Concern(ConcernCode.DAY_OFF, details={"day": FRIDAY, "name": "Audit"})
    assert noted(first) == ("Begins after Fri 20 Nov, a day off",)
