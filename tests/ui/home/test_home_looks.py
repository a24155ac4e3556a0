"""What the design promises of the page of a robot in each of its states, on the plant of the pictures."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.screens.frame.late_starts import LateSheet
from app.screens.home.cards import HomeLow
from app.widgets.frame import Frame
from tests.screenshots.home import home, late_starts
from tests.support import home_facts as sample
from tests.ui.looks import SIZES, filled, scrolls, sizes, targets, words
from tests.ui.window_sizes import window

WIDE, LOW, TALL = (1280, 800), (1024, 600), (800, 1280)
USUAL, ABNORMAL, LOWEST, LATE = 85, 110, 60, 80  # words
STATES = {
    "works": sample.FACTS,
    "ready": sample.with_aino(sample.READY, ()),
    "charges": sample.with_aino(sample.CHARGING, ()),
    "failed": sample.with_aino(sample.FAILED),
    "stopped": sample.with_aino(sample.STOPPED),
    "asks": sample.with_aino(sample.ASKING),
    "silent": sample.without_aino(),
    "on hold": replace(sample.FACTS, holds=(sample.HOLD,)),
    "waits": replace(sample.WITH_WAITING, open=sample.WITH_WAITING.open[:4]),
}
NORMAL = ("works", "ready", "charges")


@pytest.mark.parametrize("language", ["en", "fi"])
@pytest.mark.parametrize("size", [WIDE, LOW, TALL])
@pytest.mark.parametrize("state", STATES)
def test_it_keeps_to_the_design(ui, state, size, language):
    with window(ui, size, 1.0, language) as rig:
        home(rig, STATES[state])
        ui.advance(0.5)
        frame = ui.find(Frame)
        most = ABNORMAL if state not in NORMAL else LOWEST if size == LOW else USUAL
        assert len(words(frame)) <= most
        assert (scrolls(frame), targets(frame)) == ([], [])
        assert len(filled(frame)) <= 1
        assert sizes(frame) <= SIZES


@pytest.mark.parametrize("language", ["en", "fi"])
@pytest.mark.parametrize("size", [WIDE, LOW, TALL])
def test_late_starts_keep_to_the_design(ui, size, language):
    with window(ui, size, 1.0, language) as rig:
        late_starts(rig)
        ui.advance(0.5)
        sheet = ui.find(LateSheet)
        assert len(words(sheet)) <= LATE
        assert (scrolls(sheet), targets(sheet)) == ([], [])
        assert len(filled(sheet)) == 1
        assert sizes(sheet) <= SIZES


def test_a_small_window_on_its_side_has_today_and_send_beside_the_robot(ui):
    with window(ui, (819, 480)) as rig:
        home(rig, sample.FACTS)
        ui.advance(0.5)
        assert ui.find(HomeLow).width > 680
        assert (scrolls(ui.find(Frame)), targets(ui.find(Frame))) == ([], [])
