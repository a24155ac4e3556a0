"""What the design of the Logs promises, counted from the widgets: words, lists, sizes of text, targets, filled buttons."""

from __future__ import annotations

import pytest
from kivy.core.window import Window

from app.i18n import translator
from app.screens.logs.run_story import StorySheet
from tests.ui import checks, looks
from tests.ui.logbook import TABS, reset_logs, settle

MOST_WORDS = {"runs": 115, "figures": 75, "activity": 65}
WIDE, LOW, TALL = (1280, 800), (1024, 600), (800, 1280)
WINDOWS = ((WIDE, "en"), (LOW, "en"), (TALL, "en"), (WIDE, "fi"), (LOW, "fi"))


@pytest.fixture(params=WINDOWS, ids="{0[0][0]}x{0[0][1]}-{0[1]}".format)
def size(request, ui):
    before = Window.size
    Window.size, language = request.param
    translator.use(language)
    ui.advance(0.2)
    yield Window.size
    Window.size = before
    translator.use("en")
    ui.advance(0.2)


@pytest.mark.parametrize("part", TABS)
def test_a_tab_keeps_to_what_the_design_allows(logs, ui, size, part):
    reset_logs(logs, ui, part)
    screen = logs.shell.navigator.screen("logs")
    if tuple(size) != TALL:  # a narrow page has room for more rows
        assert len(looks.words(screen)) <= MOST_WORDS[part]
    assert looks.scrolls(screen) == []
    assert looks.sizes(screen) <= looks.SIZES
    assert looks.targets(screen) == []
    assert looks.filled(screen) == []
    assert checks.problems(screen) == []
    assert not [text for text in ui.texts(screen) if "…" in text]


def test_the_story_of_a_run_keeps_to_it_too(logs, ui, size):
    reset_logs(logs, ui)
    logs.logs.open_story(next(run.id for run in logs.logs.facts.rows if run.state == "failed"))
    settle(logs, ui)
    screen, sheet = logs.shell.navigator.screen("logs"), ui.find(StorySheet)
    if tuple(size) != TALL:
        covered = sheet.size == sheet.parent.size
        assert len(looks.words(sheet)) + (0 if covered else len(looks.words(screen))) <= MOST_WORDS["runs"]
    for part in (screen, sheet):
        assert looks.sizes(part) <= looks.SIZES
        assert looks.targets(part) == []
        assert looks.filled(part) == []
        assert checks.problems(part) == []
