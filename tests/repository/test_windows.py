"""The lane of tests/windows: what it needs, what it excuses, and that it never passes by testing nothing."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from tests.windows import lane
from tests.windows.excused import REASONS

ROOT = Path(__file__).parents[2]


def pins(text: str) -> dict[str, str]:
    return dict(re.findall(r"^([\w-]+)==([\w.]+)", text, re.MULTILINE))


def test_it_takes_the_versions_of_this_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    ours = pins("\n".join(project["dependency-groups"]["dev"] + project["tool"]["uv"]["constraint-dependencies"]))
    theirs = pins((lane.HERE / "requirements.txt").read_text(encoding="utf-8"))
    assert len(theirs) > 10
    assert {name: version for name, version in theirs.items() if ours.get(name, version) != version} == {}
    assert sorted(theirs.keys() - ours.keys()) == ["colorama", "panda3d"]  # Windows' own


@pytest.mark.parametrize("test", [test for tests in REASONS.values() for test in tests])
def test_what_it_excuses_exists(test: str) -> None:
    file, _colons, name = test.partition("::")
    assert f"def {name.partition('[')[0]}(" in (ROOT / "tests" / file).read_text(encoding="utf-8")


@pytest.mark.parametrize(("hidden", "said"), [("wine", "wine missing"), ("", "no CPython 3.12 is installed")])
def test_where_something_is_missing_it_says_so(monkeypatch, capsys, hidden, said):
    monkeypatch.setattr("sys.argv", ["run"])
    monkeypatch.setattr(lane.shutil, "which", lambda name: None if name in (hidden, "python3.12") else f"/bin/{name}")
    monkeypatch.setattr(lane, "_output", lambda *_words: "")
    assert lane.main() == 0
    assert capsys.readouterr().out.startswith(f"NOT TESTED on Windows: {said}")


def test_too_few_tests_are_a_failure():
    with pytest.raises(lane.Failed, match="only 3 tests passed, not 4"):
        lane._at_least(4, ["1 passed in 2 s", "no tests ran", "1 failed, 2 passed in 3 s"])
