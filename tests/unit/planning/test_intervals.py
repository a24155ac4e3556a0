"""Wilson's interval against published values (Newcombe 1998, method 3, and R's binom.confint)."""

import pytest

from app.services.planning.durations import wilson


@pytest.mark.parametrize(
    ("successes", "cases", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
        (10, 10, 0.7225, 1.0),
    ],
)
def test_the_interval_is_wilsons(successes, cases, low, high):
    assert wilson(successes, cases) == (pytest.approx(low, abs=5e-5), pytest.approx(high, abs=5e-5))


def test_nothing_is_known_without_cases():
    assert wilson(0, 0) is None
