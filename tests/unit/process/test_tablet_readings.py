"""What Linux says of the tablet: as its files say it, and None where they are missing or say nonsense."""

from __future__ import annotations

import os
import shutil
import threading
import time
from pathlib import Path

import pytest

from app.process import tablet_readings
from app.process.tablet_readings import (
    MAY_ASK_KERNEL,
    SYNCHRONISED,
    TOO_LONG_AGO,
    LastAnswer,
    battery,
    has_network,
    is_clock_synchronised,
    room,
)
from app.services.live.tablet_troubles import Battery

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Linux's files")
BATTERY = {"type": "Battery", "capacity": "14", "status": "Discharging"}
HEADER = "Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask\n"
ROUTE = "{}\t00000000\t0102A8C0\t{}\t0\t0\t600\t00000000\n"


def write(root: Path, path: str, text: str) -> None:
    (root / path).parent.mkdir(parents=True, exist_ok=True)
    (root / path).write_text(text)


# ---------------------------------------------------------------------- the battery
@pytest.mark.parametrize(
    ("supplies", "expected"),
    [
        ([BATTERY], Battery(14, False)),
        ([{**BATTERY, "status": "Charging"}], Battery(14, True)),
        ([{**BATTERY, "status": "Unknown"}, {"type": "Mains", "online": "1"}], Battery(14, True)),
        ([{**BATTERY, "status": "Unknown"}, {"type": "Mains", "online": "0"}], Battery(14, False)),
        ([BATTERY, {"type": "USB", "online": "1"}], Battery(14, False)),  # a charger too weak to charge
        ([BATTERY, {**BATTERY, "capacity": "90"}], Battery(52, False)),
        ([{**BATTERY, "capacity": "104"}], Battery(100, False)),
        ([{**BATTERY, "scope": "Device"}], None),  # of a mouse
        ([{"type": "Mains", "online": "1"}], None),
        ([{**BATTERY, "capacity": "half"}], None),
        ([{"type": "Battery"}], None),
        ([], None),
    ],
)
def test_the_battery(tmp_path, supplies, expected):
    for number, supply in enumerate(supplies):
        for name, value in supply.items():
            write(tmp_path, f"sys/class/power_supply/S{number}/{name}", value + "\n")
    assert battery(tmp_path) == expected


# ---------------------------------------------------------------------- the network
@pytest.mark.parametrize(
    ("routes", "state", "expected"),
    [
        (HEADER + ROUTE.format("wlan0", "0003"), "up", True),
        (HEADER + ROUTE.format("tun0", "0001"), "unknown", True),
        (HEADER + ROUTE.format("wlan0", "0003"), "down", False),  # an address of its own, and no access point
        (HEADER + ROUTE.format("wlan0", "0002"), "up", False),
        (HEADER + ROUTE.format("lo", "0001"), "up", False),
        (HEADER + "wlan0\t00\n\nwlan0 0 0 flags\n", "up", False),
        (HEADER, "up", False),
        ("", "up", None),
        ("\x00\x01garbage", "up", None),
    ],
)
def test_the_network(tmp_path, routes, state, expected):
    write(tmp_path, "proc/net/route", routes)
    for interface in ("wlan0", "lo"):
        write(tmp_path, f"sys/class/net/{interface}/operstate", state + "\n")
    assert has_network(tmp_path) is expected


@pytest.mark.parametrize(
    ("destination", "interface", "state", "expected"),
    [
        ("00000000000000000000000000000000", "wlan0", "up", True),
        ("fd000000000000000000000000000000", "wlan0", "up", True),
        ("fd000000000000000000000000000000", "wlan0", "down", False),
        ("00000000000000000000000000000001", "lo", "up", False),
        ("fe800000000000000000000000000000", "wlan0", "up", False),  # to its own cable
        ("ff000000000000000000000000000000", "wlan0", "up", False),
        ("garbage", "", "up", False),
    ],
)
def test_a_network_of_ipv6_alone(tmp_path, destination, interface, state, expected):
    none = "0" * 32
    write(tmp_path, "proc/net/route", HEADER)
    write(
        tmp_path,
        "proc/net/ipv6_route",
        f"{destination} 40 {none} 00 {none} 00000100 00000001 00000000 00000001 {interface}\n",
    )
    write(tmp_path, f"sys/class/net/{interface or 'wlan0'}/operstate", state + "\n")
    assert has_network(tmp_path) is expected


def test_without_a_list_of_routes_nothing_is_known_of_the_network(tmp_path):
    assert has_network(tmp_path) is None


# ---------------------------------------------------------------------- the clock
@pytest.mark.parametrize(("error", "expected"), [(1500, True), (16_000_000, False), (None, None)])
def test_the_kernel_says_whether_a_time_server_sets_the_clock(tmp_path, monkeypatch, error, expected):
    write(tmp_path, "proc/self/status", "Name:\tpython\nSeccomp:\t0\n")
    monkeypatch.setattr(tablet_readings, "_largest_error", lambda: error)
    assert is_clock_synchronised(tmp_path) is expected


@pytest.mark.parametrize("status", ["Name:\tpython\nSeccomp:\t2\n", ""])
def test_where_calls_of_the_system_are_filtered_the_kernel_is_not_asked(tmp_path, monkeypatch, status):
    write(tmp_path, "proc/self/status", status)
    monkeypatch.setattr(tablet_readings, "_largest_error", lambda: pytest.fail("it may end the process"))
    assert is_clock_synchronised(tmp_path) is None  # no timesyncd
    mark = tmp_path / SYNCHRONISED
    mark.parent.mkdir(parents=True)
    assert is_clock_synchronised(tmp_path) is False
    mark.touch()
    assert is_clock_synchronised(tmp_path) is True
    os.utime(mark, (time.time() - TOO_LONG_AGO - 60,) * 2)
    assert is_clock_synchronised(tmp_path) is False


def test_a_service_that_may_ask_the_kernel_does(tmp_path, monkeypatch):
    write(tmp_path, "proc/self/status", "Name:\tpython\nSeccomp:\t2\n")
    monkeypatch.setenv(MAY_ASK_KERNEL, "1")
    monkeypatch.setattr(tablet_readings, "_largest_error", lambda: 1500)
    assert is_clock_synchronised(tmp_path) is True


def test_this_kernel_can_be_asked():
    error = tablet_readings._largest_error()
    assert error is None or error >= 0


# ---------------------------------------------------------------------- the disk
def test_the_room_on_the_disk_of_the_database(tmp_path):
    database = tmp_path / "amr-scheduler.db"
    assert room(database) is None
    database.write_bytes(b"x" * 5000)
    found = room(database)
    assert found.database == 5000
    assert abs(found.free - shutil.disk_usage(tmp_path).free) < 100 * 2**20


# ---------------------------------------------------------------------- what never answers
def test_a_driver_that_hangs_is_asked_once_and_the_last_answer_stays():
    answers, hangs, asked = iter([14, 13, 12]), threading.Event(), []

    def ask() -> int:
        asked.append(threading.current_thread())
        if len(asked) == 2:
            hangs.wait(20)
        return next(answers)

    last = LastAnswer(ask)
    assert [last(), last(), last()] == [14, 14, 14]
    assert len(asked) == 2
    hangs.set()
    asked[-1].join(20)
    assert last() == 12
