"""What is shipped: every version is pinned and has its sums, and the bill of materials names what is installed."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import tomllib
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from app.services.files.about import LICENCES

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SUMS = (ROOT / "packaging" / "requirements.txt").read_text(encoding="utf-8")
SHIPPED = ["--no-default-groups", "--group", "ui"]


@cache
def exported(form: str) -> str:
    """The output of the documented command, from the versions locked by `uv run`, without a request."""
    uv = os.environ.get("UV") or shutil.which("uv") or "uv"
    return subprocess.run(
        [uv, "export", "--frozen", "--offline", "--quiet", "--format", form, *SHIPPED],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
        timeout=60,
    ).stdout


def components() -> list[dict[str, Any]]:
    return list(json.loads(exported("cyclonedx1.5"))["components"])


def is_for_this_platform(component: dict[str, Any]) -> bool:
    markers = [each["value"] for each in component.get("properties", ()) if each["name"] == "uv:package:marker"]
    return all(Marker(marker).evaluate() for marker in markers)


def installed(wanted: list[str]) -> dict[str, str]:
    """These and all that they need on this machine, with their versions."""
    left_out = {canonicalize_name(Requirement(each).name) for each in PROJECT["tool"]["uv"]["override-dependencies"]}
    found: dict[str, str] = {}
    while wanted:
        requirement = Requirement(wanted.pop())
        name = canonicalize_name(requirement.name)
        if (
            name not in found
            and name not in left_out
            and (requirement.marker is None or requirement.marker.evaluate({"extra": ""}))
        ):
            found[name] = metadata.version(name)
            wanted += metadata.requires(name) or []
    return found


def sums_of(text: str) -> dict[str, set[str]]:
    """By name, version and marker."""
    found = {}
    for block in re.split(r"\n(?=\w)", text.replace("\\\n", " ")):
        if line := block.partition("#")[0].strip():
            found[line.partition("--hash")[0].strip()] = set(re.findall(r"--hash=sha256:([0-9a-f]{64})", line))
    return found


def test_the_bill_of_materials_equals_what_is_installed():
    listed = {component["name"]: component["version"] for component in components() if is_for_this_platform(component)}
    assert listed == installed([*PROJECT["project"]["dependencies"], *PROJECT["dependency-groups"]["ui"]])


def test_about_names_what_is_shipped():
    assert {canonicalize_name(name) for name, _licence in LICENCES} == {
        each["name"] for each in components() if is_for_this_platform(each)
    }


def test_every_version_is_pinned():
    pinned = {
        canonicalize_name(requirement.name): str(requirement.specifier)
        for requirement in map(
            Requirement,
            [
                *PROJECT["project"]["dependencies"],
                *PROJECT["dependency-groups"]["ui"],
                *PROJECT["tool"]["uv"]["constraint-dependencies"],
            ],
        )
    }
    assert {each["name"]: f"=={each['version']}" for each in components()}.items() <= pinned.items()


def test_every_file_that_may_be_installed_has_its_sum():
    """Sums that are added later, for other platforms, must not fail the test."""
    now, kept = sums_of(exported("requirements.txt")), sums_of(SUMS)
    assert kept.keys() == now.keys()
    assert all(kept.values())
    assert [name for name in kept if not kept[name] <= now[name]] == []
    assert "://" not in SUMS
