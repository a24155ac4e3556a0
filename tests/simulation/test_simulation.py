"""Days of operation in which everything happens, without a violation; the same seed gives the same run; twins send the same."""

from __future__ import annotations

import pytest

from tests.simulation.__main__ import simulate
from tests.simulation.profile import Profile
from tests.simulation.twins import Twin, sent
from tests.simulation.world import World


@pytest.mark.parametrize(
    ("seed", "hours"),
    [(24, 2.0), *(pytest.param(seed, 5.0, marks=pytest.mark.long) for seed in (6, 11, 12, 18))],
)
def test_nothing_is_doubled_or_lost_and_rows_are_true(seed, hours):
    """Each is as many simulated hours; any number by hand: ``python -m tests.simulation``."""
    found = simulate(seed, hours)
    assert found.violations == [], found.line(seed)
    assert found.submissions > 0
    assert sum(found.acts.values()) >= 5 * hours
    assert sum(found.faults.values()) >= 5 * hours


@pytest.mark.long
@pytest.mark.parametrize("seed", [11, 12, 13, 20])
def test_nor_where_any_of_several_robots_may_take_a_start(seed):
    """The same with ``--groups``."""
    found = simulate(seed, 0.4, Profile().with_groups())
    assert found.violations == [], found.line(seed)
    assert found.submissions > 50


@pytest.mark.parametrize(
    ("seed", "hours"), [(3, 1.0), *(pytest.param(seed, 5.0, marks=pytest.mark.long) for seed in (4, 5))]
)
def test_nor_on_robots_that_differ_checked_up_or_not(seed, hours):
    """The same with ``--deviants``."""
    found = simulate(seed, hours, Profile(deviants=True))
    assert found.violations == [], found.line(seed)
    assert found.submissions > 0


@pytest.mark.long
def test_in_calm_weather_every_start_is_on_time():
    found = simulate(
        1,
        0.5,
        Profile(
            acts_per_hour=0, events_per_hour=0, fault_rate=0.0, crash_rate=0.0, site={"robots": 2, "every_minutes": 3}
        ),
    )
    assert found.violations == []
    assert found.submissions >= 20
    assert found.punctual >= found.submissions - 1  # the first one comes too soon to say what was before it


@pytest.mark.parametrize("seed", [17, pytest.param(18, marks=pytest.mark.long)])
def test_the_same_seed_gives_the_same_run(tmp_path, seed):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    first, again = (World(tmp_path / name, seed).run(0.6) for name in "ab")
    assert first == again


@pytest.mark.long
@pytest.mark.parametrize(
    ("seed", "twin"),
    [
        pytest.param(1, Twin(history_limit=1), id="history of one row"),
        pytest.param(2, Twin(restarts_at=(600.0, 1500.0)), id="started again at rest"),
        pytest.param(3, Twin(screen_s=10.0), id="somebody looks", marks=pytest.mark.long),
        pytest.param(4, Twin(history_limit=1, restarts_at=(900.0,)), id="both", marks=pytest.mark.long),
    ],
)
def test_twins_send_the_same(tmp_path, seed, twin):
    """How much history is kept, who looks, and a restart at rest decide nothing."""
    assert sent(tmp_path / "one", seed, Twin()) == sent(tmp_path / "other", seed, twin)
