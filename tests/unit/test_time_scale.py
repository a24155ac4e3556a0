"""Hours as a timeline draws them."""

import pytest

from app.widgets.time_scale import TimeScale

SCALE = TimeScale([(54.0, 60.0), (6.0, 30.0)], 4.0)


@pytest.mark.parametrize(
    ("hour", "drawn"), [(-3, -3), (6, 6), (18, 8), (30, 10), (54, 34), (57, 36), (60, 38), (61, 39)]
)
def test_folded_time_takes_the_width_that_is_set(hour, drawn):
    assert SCALE.drawn(hour) == pytest.approx(drawn)
    assert SCALE.hour(drawn) == pytest.approx(hour)


def test_a_fold_never_takes_more_room_than_its_time():
    assert TimeScale([(6.0, 30.0)], 100.0).drawn(40) == 40
