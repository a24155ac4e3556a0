"""What `packaging/release.py` adds to the wheels it fetches: sums, a bill of materials, and stand-ins for parts that are not used."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import zipfile
from datetime import UTC, datetime
from importlib import util
from importlib.metadata import Distribution, distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
spec = util.spec_from_file_location("release", ROOT / "packaging" / "release.py")
release = util.module_from_spec(spec)
spec.loader.exec_module(release)
OWN = "amr_scheduler-9.8.7-py3-none-any.whl"


@pytest.fixture
def wheels(tmp_path: Path) -> Path:
    """A folder as it is after fetching, with small files in the place of wheels."""
    for each in release.pinned():
        name, version = each.name.replace("-", "_"), str(each.specifier)[2:]
        for tag in ("cp311-cp311-win_amd64", "cp312-cp312-win_amd64"):
            (tmp_path / f"{name}-{version}-{tag}.whl").write_text(f"{name} {tag}")
    for path in tmp_path.glob("pycairo-*"):
        path.unlink()
    release.add_pycairo_stub(tmp_path)
    (tmp_path / OWN).write_text("ours")
    return tmp_path


def sums(folder: Path) -> set[str]:
    return {hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def installed(wheel: Path, into: Path) -> Distribution:
    with zipfile.ZipFile(wheel) as file:
        file.extractall(into)
    (found,) = distributions(path=[str(into)])
    return found


def test_requirements_name_every_file_once_by_its_sum(wheels: Path):
    lines = release.requirements(wheels, "9.8.7").replace("\\\n", "").splitlines()
    names = [Requirement(line.partition("--hash")[0]) for line in lines]
    assert sorted(re.findall(r"--hash=sha256:(\w+)", "\n".join(lines))) == sorted(sums(wheels))
    assert {canonicalize_name(each.name) for each in names} == {
        "amr-scheduler",
        *(canonicalize_name(each.name) for each in release.pinned()),
    }
    assert "amr-scheduler[ui]==9.8.7" in map(str, names)
    assert "pycairo==1.29.2+none" in map(str, names)
    assert 'pywin32==312; sys_platform == "win32"' in map(str, names)


def test_each_system_gets_what_its_markers_say():
    wanted = {
        (platform, python): "\n".join(release.lines_for({**markers, "python_full_version": f"{python}.0"}, platform))
        for platform, markers in release.PLATFORMS.items()
        for python in release.PYTHONS
    }
    assert {key for key, text in wanted.items() if "pywin32==" in text} == {
        ("win_amd64", each) for each in release.PYTHONS
    }
    assert {python for (_, python), text in wanted.items() if "typing-extensions==" in text} == {"3.11", "3.12"}
    assert {platform for (platform, _), text in wanted.items() if "materialyoucolor==" not in text} == {
        "manylinux_2_28_aarch64"
    }
    assert not any("pycairo==" in text for text in wanted.values())
    assert all(" --hash=sha256:" in line for text in wanted.values() for line in text.splitlines())


def test_the_bill_of_materials_names_the_files_of_the_folder(wheels: Path):
    bill = release.sbom(wheels, datetime(2026, 1, 2, tzinfo=UTC))
    parts = [bill["metadata"]["component"], *bill["components"]]
    listed = {
        reference["url"]: reference["hashes"][0]["content"]
        for part in parts
        for reference in part["externalReferences"]
    }
    assert listed.keys() == {f"wheels/{path.name}" for path in wheels.iterdir()}
    assert set(listed.values()) == sums(wheels)
    assert bill["metadata"]["timestamp"] == "2026-01-02T00:00:00Z"
    assert "://" not in json.dumps(bill)
    assert release.sbom(wheels, datetime(2026, 1, 2, tzinfo=UTC)) == bill


def test_the_stub_of_pycairo_installs_as_that_version_and_brings_nothing(
    wheels: Path, tmp_path_factory: pytest.TempPathFactory
):
    found = installed(next(wheels.glob("pycairo-*")), tmp_path_factory.mktemp("site"))
    assert (found.version, found.requires) == ("1.29.2+none", None)
    assert {path.name for path in found.files} == {"METADATA", "WHEEL", "RECORD"}


def test_the_colours_for_arm_import_without_what_is_compiled(tmp_path: Path):
    import materialyoucolor

    package = Path(materialyoucolor.__file__).parent
    files = {
        path.relative_to(package.parent).as_posix(): path.read_bytes()
        for path in package.rglob("*")
        if path.suffix in (".py", ".so")
    }
    release.write_wheel(
        tmp_path,
        "materialyoucolor",
        "3.0.4",
        "cp311-cp311-manylinux_2_28_x86_64",
        files,
        b"Metadata-Version: 2.1\nName: materialyoucolor\nVersion: 3.0.4\n",
    )
    release.add_materialyoucolor_for_arm(tmp_path)
    site = tmp_path / "site"
    found = installed(tmp_path / "materialyoucolor-3.0.4+pure-py3-none-manylinux_2_17_aarch64.whl", site)
    assert found.version == "3.0.4+pure"
    assert not list(site.rglob("*.so"))
    used = (
        f"import sys; sys.path.insert(0, {str(site)!r}); import materialyoucolor.utils.platform_utils as colours; "
        "print(colours.__file__, colours.ImageQuantizeCelebi, len(colours.SCHEMES) > 5)"
    )
    done = subprocess.run([sys.executable, "-c", used], capture_output=True, text=True, check=True)
    assert done.stdout == f"{site}/materialyoucolor/utils/platform_utils.py None True\n"


def test_a_folder_that_exists_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(sys, "argv", ["release.py", str(tmp_path)])
    assert release.main() == 2
    assert capsys.readouterr().err == f"release.py: {tmp_path} exists: remove it, or name another folder\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("problem", "sentence"),
    [
        (subprocess.CalledProcessError(1, ["/usr/bin/git", "log"]), "git failed, see above"),
        (OSError(28, "No space left on device", "/stick/x"), "[Errno 28] No space left on device: '/stick/x'"),
    ],
)
def test_a_folder_that_cant_be_made_is_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    problem: Exception,
    sentence: str,
):
    def fails(_out: Path) -> None:
        raise problem

    monkeypatch.setattr(release, "make", fails)
    monkeypatch.setattr(sys, "argv", ["release.py", str(tmp_path / "release")])
    assert release.main() == 1
    assert capsys.readouterr().err == f"release.py: {sentence}; {tmp_path / 'release.part'} is not whole\n"
    assert not (tmp_path / "release").exists()
