"""Makes the installer for Windows out of a release folder; needs makensis (Debian: `apt install nsis`):

    uv run python packaging/windows/make_setup.py RELEASE OUT

OUT gets `amr-scheduler-VERSION-setup.exe`. If RELEASE has an embeddable Python from python.org (`python-3.12.10-embed-amd64.zip`), it
carries that; otherwise it uses one that is installed.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

NSI = Path(__file__).with_name("setup.nsi")


class Unfit(Exception):
    """What can't be used, in one sentence."""


def check(release: Path) -> None:
    """Raises Unfit where a file is missing or another than was released."""
    for line in (release / "SHA256SUMS").read_text(encoding="utf-8").splitlines():
        expected, name = line.split("  ", 1)
        path = release / name
        if not path.is_file() or hashlib.sha256(path.read_bytes()).hexdigest() != expected:
            raise Unfit(f"{path} is missing or another file than SHA256SUMS says; make the release folder again")


def version_in(release: Path) -> str:
    (wheel,) = (release / "wheels").glob("amr_scheduler-*.whl")
    return wheel.name.split("-")[1]


def carried_python(release: Path) -> tuple[Path, str] | None:
    """The embeddable Python and its version, as "3.12". Raises Unfit for one that the wheels are not for."""
    for path in sorted(release.glob("python-*-embed-amd64.zip")):
        version = re.match(r"python-(3\.\d+)\.", path.name)
        if version is None or not list(
            (release / "wheels").glob(f"Kivy-*-cp{version[1].replace('.', '')}-win_amd64.whl")
        ):
            raise Unfit(f"{path.name} is no Python that the wheels are for: take one of 3.11, 3.12, 3.13")
        return path, version[1]
    return None


def lay_out(release: Path, python: tuple[Path, str] | None, stage: Path) -> None:
    """What the installer unpacks: all wheels for Windows, or a Python with the app installed in it."""
    if python is None:
        (stage / "wheels").mkdir()
        for wheel in (release / "wheels").glob("*.whl"):
            if wheel.name.endswith(("-win_amd64.whl", "-any.whl")):
                shutil.copy(wheel, stage / "wheels")
        return
    archive, version = python
    home = unpacked(archive, stage / "python")
    site = home / "Lib" / "site-packages"
    uv = os.environ.get("UV") or shutil.which("uv") or "uv"
    where = ["--no-index", "--find-links", str(release / "wheels"), "--only-binary", ":all:", "--link-mode", "copy"]
    system = ["--python-platform", "x86_64-pc-windows-msvc", "--python-version", version, "--target", str(site)]
    app = f"amr-scheduler[ui]=={version_in(release)}"
    subprocess.run([uv, "pip", "install", "--quiet", "--no-config", *where, *system, app], check=True)
    shutil.move(site / "share", home / "share")  # SDL and its kin, which belong to Python's own folder
    shutil.rmtree(site / "bin", ignore_errors=True)  # launchers for the system that this runs on


def unpacked(archive: Path, home: Path) -> Path:
    """The embeddable Python, looking for packages in its Lib too."""
    with zipfile.ZipFile(archive) as file:
        file.extractall(home)
    (paths,) = home.glob("python3*._pth")
    folders = paths.read_text(encoding="utf-8").replace("#import site", "import site").splitlines()
    folders.insert(folders.index(".") + 1, r"Lib\site-packages")
    paths.write_text("\n".join(folders) + "\n", encoding="utf-8")
    return home


def make(release: Path, out: Path) -> Path:
    """Returns the installer. Raises Unfit, OSError or CalledProcessError."""
    if shutil.which("makensis") is None:
        raise Unfit("makensis is missing: install nsis")
    check(release)
    python, version = carried_python(release), version_in(release)
    setup = out.absolute() / f"amr-scheduler-{version}-setup.exe"
    setup.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder)
        lay_out(release, python, stage)
        defined = {"VERSION": version, "STAGE": str(stage), "OUT": str(setup)}
        if python is not None:
            defined["EMBEDDED"] = python[1]
        subprocess.run(
            ["makensis", "-V2", "-WX", *(f"-D{name}={value}" for name, value in defined.items()), str(NSI)], check=True
        )
    return setup


def main() -> int:
    options = argparse.ArgumentParser(
        description="Makes the installer for Windows out of a release folder.", allow_abbrev=False
    )
    options.add_argument("release", type=Path, metavar="RELEASE")
    options.add_argument("out", type=Path, metavar="OUT")
    arguments = options.parse_args()
    try:
        setup = make(arguments.release.absolute(), arguments.out)
    except (Unfit, OSError, subprocess.CalledProcessError) as problem:
        print(f"make_setup.py: {problem}", file=sys.stderr)
        return 1
    print(f"{setup}: {setup.stat().st_size / 1e6:.0f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
