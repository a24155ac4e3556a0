"""The same seed and the same requests at the same simulated times give the same bytes, however often the robot was asked in between."""

from __future__ import annotations

import random

from tests.unit.sim.asking import GUIDS, Asker

PATHS = (
    "/status",
    "/mission_queue?whitelist=all",
    "/missions",
    "/metrics",
    "/statistics/distance",
    "/log/error_reports",
    "/registers",
    "/experimental/diagnostics",
    "/sessions",
)


def life(requests: int, polls: int, **options: object) -> list[bytes]:
    """The answers to hours of missions, holds and faults drawn by a fixed seed, without those of the ``polls`` requests in between."""
    asker, rng, answers = Asker(failure_rate=0.2, **options), random.Random(3), []
    for _ in range(requests):
        pause = rng.uniform(0, 90)
        target = asker.robot.now + pause
        for look in range(polls):
            asker.robot.advance_to(target - pause + pause * look / polls)
            asker.send("GET", "/status")
        asker.robot.advance_to(target)
        match rng.randrange(9):
            case 0 | 1 | 2:
                answer = asker.send(
                    "POST",
                    "/mission_queue",
                    {"mission_id": GUIDS[rng.choice(["Deliver", "Home", "Return to charger"])]},
                )
            case 3:
                answer = asker.send("PUT", "/status", {"state_id": rng.choice([3, 4])})
            case 4:
                answer = asker.send("PUT", "/status", {"clear_error": True, "state_id": 3})
            case 5:
                answer = asker.send("DELETE", f"/mission_queue/{rng.randrange(1, 40)}")
            case 6:
                asker.control(battery=rng.uniform(20, 90), fault={"kind": "garbage"})
                answer = asker.exchange("GET", "/missions").response
            case _:
                answer = asker.send("GET", rng.choice(PATHS))
        answers.append(answer.body)
    return answers


def test_the_same_requests_give_the_same_bytes_though_somebody_looks_in_between() -> None:
    assert life(200, polls=0) == life(200, polls=7)


def test_another_seed_is_another_robot() -> None:
    assert life(50, polls=0, seed=1) != life(50, polls=0, seed=2)


def test_a_year_passes_quickly_and_means_the_same() -> None:
    asker = Asker()
    asker.order("Return to charger")
    asker.pass_time(365 * 86_400.0)
    assert asker.status()["mission_text"] == "Charging... Waiting for new mission..."
    assert asker.robot.stamp() == "2027-11-23T07:00:00"
