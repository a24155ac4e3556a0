"""What the installer for Windows is made of: only what was released, and the Python that the folder carries."""

from __future__ import annotations

import hashlib
import zipfile
from importlib import util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
spec = util.spec_from_file_location("make_setup", ROOT / "packaging" / "windows" / "make_setup.py")
make_setup = util.module_from_spec(spec)
spec.loader.exec_module(make_setup)


@pytest.fixture
def release(tmp_path: Path) -> Path:
    """A release folder of three small files."""
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    names = (
        "amr_scheduler-9.8.7-py3-none-any.whl",
        "Kivy-2.3.1-cp312-cp312-win_amd64.whl",
        "Kivy-2.3.1-cp312-cp312-manylinux_2_17_x86_64.whl",
    )
    for name in names:
        (wheels / name).write_text(name)
    sums = [f"{hashlib.sha256(name.encode()).hexdigest()}  wheels/{name}\n" for name in names]
    (tmp_path / "SHA256SUMS").write_text("".join(sums))
    return tmp_path


def test_a_file_that_was_changed_or_lost_is_named(release: Path):
    make_setup.check(release)
    kivy = release / "wheels" / "Kivy-2.3.1-cp312-cp312-win_amd64.whl"
    for spoil in (lambda: kivy.write_text("another"), kivy.unlink):
        spoil()
        with pytest.raises(make_setup.Unfit, match=r"Kivy-\S+-win_amd64\.whl is missing or another file"):
            make_setup.check(release)


def test_without_a_python_the_wheels_for_windows_are_carried(release: Path, tmp_path_factory: pytest.TempPathFactory):
    stage = tmp_path_factory.mktemp("stage")
    assert make_setup.carried_python(release) is None
    make_setup.lay_out(release, None, stage)
    assert {path.relative_to(stage).as_posix() for path in stage.rglob("*.*")} == {
        "wheels/amr_scheduler-9.8.7-py3-none-any.whl",
        "wheels/Kivy-2.3.1-cp312-cp312-win_amd64.whl",
    }


def test_a_python_that_the_wheels_are_not_for_is_refused(release: Path):
    fits = release / "python-3.12.10-embed-amd64.zip"
    fits.touch()
    assert make_setup.carried_python(release) == (fits, "3.12")
    fits.rename(release / "python-3.14.1-embed-amd64.zip")
    with pytest.raises(
        make_setup.Unfit, match=r"python-3\.14\.1-embed-amd64\.zip is no Python that the wheels are for"
    ):
        make_setup.carried_python(release)


def test_the_carried_python_finds_what_is_installed_in_it(release: Path, tmp_path_factory: pytest.TempPathFactory):
    with zipfile.ZipFile(release / "python-3.12.10-embed-amd64.zip", "w") as archive:
        archive.writestr(
            "python312._pth",
            "python312.zip\r\n.\r\n\r\n# Uncomment to run site.main() automatically\r\n#import site\r\n",
        )
    home = make_setup.unpacked(release / "python-3.12.10-embed-amd64.zip", tmp_path_factory.mktemp("home"))
    lines = (home / "python312._pth").read_text().splitlines()
    assert lines[:3] == ["python312.zip", ".", "Lib\\site-packages"]
    assert lines[-1] == "import site"
