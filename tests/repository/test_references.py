"""Code and pages refer only to pages that are in this repository."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = re.compile(r"(?<![\w/*])[\w./-]*\w\.md\b")
ELSEWHERE = re.compile(
    r"\((?:design|contract|reference|kivy-notes)(?:[:,] (?:\"|section|step|[A-Z])|\))|\.\./shared", re.IGNORECASE
)


def sources() -> Iterator[Path]:
    for folder, kinds in (("app", "py"), ("mir_sim", "py"), ("tests", "py"), ("kv", "kv"), ("docs", "md"), (".", "md")):
        yield from sorted((ROOT / folder).rglob(f"*.{kinds}") if folder != "." else ROOT.glob("*.md"))
    yield ROOT / "main.py"


def test_every_page_that_is_named_exists() -> None:
    missing = []
    for path in sources():
        for name in PAGE.findall(path.read_text(encoding="utf-8")):
            if not any((folder / name).exists() for folder in (ROOT, ROOT / "docs", path.parent)):
                missing.append(f"{path.relative_to(ROOT)}: {name}")
    assert missing == []


def test_every_test_file_that_a_page_names_exists() -> None:
    there = {path.stem for path in (ROOT / "tests").rglob("test_*.py")}
    named = {
        name
        for page in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"))
        for name in re.findall(r"`(?:[\w/]*/)?(test_\w+)(?:\.py)?`", page.read_text(encoding="utf-8"))
    }
    assert len(named) > 20
    assert named - there == set()


def test_nothing_refers_to_pages_outside_the_repository() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sources()
        if path != Path(__file__)
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if ELSEWHERE.search(line)
    ]
    assert found == []


def test_a_rule_of_kv_means_one_class() -> None:
    """Kv knows classes by their bare names: of two it would lay one out as the other."""
    named, classes = set(), Counter[str]()
    for path in (ROOT / "kv").rglob("*.kv"):
        rules = re.findall(r"^<-?([\w, ]+)>:", path.read_text(encoding="utf-8"), re.MULTILINE)
        named |= {name for rule in rules for name in rule.split(",")}
    for path in (*(ROOT / "app" / "screens").rglob("*.py"), *(ROOT / "app" / "widgets").rglob("*.py")):
        classes.update(re.findall(r"^class (\w+)\((?!NamedTuple)", path.read_text(encoding="utf-8"), re.MULTILINE))
    assert len(named) > 100
    assert {name: classes[name] for name in named if classes[name] > 1} == {}
