"""Time zones to choose from."""

from __future__ import annotations

from datetime import UTC, datetime

from app.screens.common.zones import zone_options

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
NAMES = ["Europe/Helsinki", "America/New_York", "Etc/GMT+3", "EST"]


def test_zones_are_places_with_their_time_and_difference_from_utc():
    options = {option.key: option for option in zone_options(NAMES, NOW)}
    assert list(options) == ["America/New_York", "Europe/Helsinki", "UTC"]
    assert options["Europe/Helsinki"].note == "14:38 · UTC+02:00"
    assert (options["America/New_York"].text, options["America/New_York"].note) == (
        "America/New York",
        "07:38 · UTC−05:00",
    )


def test_the_guess_is_on_top_whatever_it_is():
    assert [option.key for option in zone_options(NAMES, NOW, "Europe/Helsinki")] == [
        "Europe/Helsinki",
        "America/New_York",
        "UTC",
    ]
    assert next(iter(zone_options(NAMES, NOW, "EST"))).key == "EST"
