"""Makes the folder that an installation needs, for machines without a network:

    uv run python packaging/release.py OUT

OUT gets `wheels/` (the app and everything it runs with, for CPython 3.11-3.13 on Linux x86_64 and aarch64 and on Windows x86_64),
`requirements.txt` with their sums, `sbom.cdx.json`, `INSTALL.md` and `SHA256SUMS`. The same commit makes the same bytes.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import hatchling.build
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.11", "3.12", "3.13")
PLATFORMS = {  # by what pip calls them, the values of environment markers
    "manylinux_2_28_x86_64": {
        "sys_platform": "linux",
        "platform_system": "Linux",
        "platform_machine": "x86_64",
        "os_name": "posix",
    },
    "manylinux_2_28_aarch64": {
        "sys_platform": "linux",
        "platform_system": "Linux",
        "platform_machine": "aarch64",
        "os_name": "posix",
    },
    "win_amd64": {"sys_platform": "win32", "platform_system": "Windows", "platform_machine": "AMD64", "os_name": "nt"},
}
# pip takes a platform by its word: each one that a wheel for this glibc or an older one may name.
GLIBC = ("2_28", "2_27", "2_17", "2_12", "2_5")
NOT_USED = "Left out of AMR Scheduler, which does not use it."


def pinned() -> dict[Requirement, list[str]]:
    """All that is shipped, with the options of pip that name the sums."""
    text = (ROOT / "packaging" / "requirements.txt").read_text(encoding="utf-8").replace("\\\n", " ")
    blocks = [line.partition(" --hash") for line in text.splitlines() if line.strip()]
    return {Requirement(name): f"{dash}{sums}".split() for name, dash, sums in blocks}


def fetch(wheels: Path) -> None:
    """Raises CalledProcessError where a wheel is missing or has another sum."""
    for platform, markers in PLATFORMS.items():
        names = [platform.replace("2_28", version) for version in GLIBC] if "2_28" in platform else [platform]
        for python in PYTHONS:
            environment = {**markers, "python_version": python, "python_full_version": f"{python}.0", "extra": ""}
            with tempfile.TemporaryDirectory() as folder:
                wanted = Path(folder) / "wanted.txt"
                wanted.write_text("".join(f"{line}\n" for line in lines_for(environment, platform)), encoding="utf-8")
                subprocess.run(
                    [sys.executable, "-m", "pip", "download", "-qq", "--require-hashes", "--no-deps"]
                    + ["--only-binary", ":all:", "--python-version", python, "--dest", str(wheels)]
                    + [word for name in names for word in ("--platform", name)]
                    + ["--requirement", str(wanted)],
                    check=True,
                )


def lines_for(environment: Mapping[str, str], platform: str) -> Iterator[str]:
    """pip would evaluate the markers for the machine it runs on."""
    for requirement, sums in pinned().items():
        is_made_here = requirement.name == "materialyoucolor" and platform.endswith("aarch64")
        if not is_made_here and (requirement.marker is None or requirement.marker.evaluate(dict(environment))):
            yield f"{requirement.name}{requirement.specifier} {' '.join(sums)}"


# ---------------------------------------------------------------------- wheels that are made here
def write_wheel(wheels: Path, name: str, version: str, tag: str, files: Mapping[str, bytes], about: bytes) -> None:
    info = f"{name}-{version}.dist-info"
    is_pure = "true" if tag.endswith("-any") else "false"
    head = f"Wheel-Version: 1.0\nGenerator: release.py\nRoot-Is-Purelib: {is_pure}\nTag: {tag}\n".encode()
    whole = {**files, f"{info}/METADATA": about, f"{info}/WHEEL": head}
    record = "".join(f"{path},sha256={urlsafe(content)},{len(content)}\n" for path, content in whole.items())
    with zipfile.ZipFile(wheels / f"{name}-{version}-{tag}.whl", "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in {**whole, f"{info}/RECORD": f"{record}{info}/RECORD,,\n".encode()}.items():
            wheel.writestr(zipfile.ZipInfo(path, (2020, 2, 2, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)


def urlsafe(content: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()


def add_pycairo_stub(wheels: Path) -> None:
    """KivyMD asks for pycairo, which has wheels for Windows only, for one widget that the app does not use."""
    version = next(str(each.specifier)[2:] for each in pinned() if each.name == "pycairo") + "+none"
    about = f"Metadata-Version: 2.1\nName: pycairo\nVersion: {version}\nSummary: {NOT_USED}\n".encode()
    write_wheel(wheels, "pycairo", version, "py3-none-any", {}, about)


def add_materialyoucolor_for_arm(wheels: Path) -> None:
    """There is no wheel for aarch64: what is compiled in it takes colours out of pictures, and it imports without."""
    source = next(wheels.glob("materialyoucolor-*-cp311-*_x86_64.whl"))
    _name, version, _build, _tags = parse_wheel_filename(source.name)
    own = f"{version}+pure"
    info = f"materialyoucolor-{version}.dist-info"
    with zipfile.ZipFile(source) as wheel:
        about = wheel.read(f"{info}/METADATA").replace(
            f"\nVersion: {version}\n".encode(), f"\nVersion: {own}\n".encode(), 1
        )
        files = {
            path.replace(info, f"materialyoucolor-{own}.dist-info"): wheel.read(path)
            for path in wheel.namelist()
            if not path.endswith((".so", "/", "/METADATA", "/WHEEL", "/RECORD"))
        }
    write_wheel(wheels, "materialyoucolor", own, "py3-none-manylinux_2_17_aarch64", files, about)


# ---------------------------------------------------------------------- what lies beside them
def sum_of(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def by_name(wheels: Path) -> dict[str, list[Path]]:
    found: dict[str, list[Path]] = {}
    for path in sorted(wheels.iterdir()):
        found.setdefault(parse_wheel_filename(path.name)[0], []).append(path)
    return found


def requirements(wheels: Path, version: str) -> str:
    """For `pip install --require-hashes`: only the files of this folder will do."""
    markers = {str(canonicalize_name(each.name)): each.marker for each in pinned()}
    lines = []
    for name, files in by_name(wheels).items():
        wanted = f"amr-scheduler[ui]=={version}" if name == "amr-scheduler" else f"{name}=={version_of(files)}"
        marker = markers.get(name) if name != "pycairo" else None
        lines.append(
            f"{wanted}{f' ; {marker}' if marker else ''}"
            + "".join(f" \\\n    --hash=sha256:{sum_of(path)}" for path in files)
        )
    return "\n".join(lines) + "\n"


def version_of(files: list[Path]) -> str:
    """A local version, as of the stub, only where all have it."""
    versions = {parse_wheel_filename(path.name)[1] for path in files}
    return str(versions.pop()) if len(versions) == 1 else min(versions).public


def sbom(wheels: Path, made: datetime) -> dict[str, Any]:
    """uv's bill of materials (CycloneDX 1.5), with the files of this folder in the place of addresses."""
    command = [
        "export",
        "--frozen",
        "--offline",
        "--quiet",
        "--format",
        "cyclonedx1.5",
        "--no-default-groups",
        "--group",
        "ui",
    ]
    uv = os.environ.get("UV") or shutil.which("uv") or "uv"
    bill: dict[str, Any] = json.loads(subprocess.run([uv, *command], cwd=ROOT, check=True, capture_output=True).stdout)
    del bill["serialNumber"]
    bill["metadata"]["timestamp"] = made.isoformat().replace("+00:00", "Z")
    files = by_name(wheels)
    for component in [bill["metadata"]["component"], *bill["components"]]:
        component["externalReferences"] = [
            {
                "type": "distribution",
                "url": f"wheels/{path.name}",
                "hashes": [{"alg": "SHA-256", "content": sum_of(path)}],
            }
            for path in files[canonicalize_name(component["name"])]
        ]
    return bill


def make(out: Path) -> None:
    wheels = out / "wheels"
    wheels.mkdir(parents=True)
    stamp = subprocess.run(
        ["git", "log", "-1", "--format=%ct"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.strip()
    os.environ["SOURCE_DATE_EPOCH"] = stamp
    os.chdir(ROOT)
    own = hatchling.build.build_wheel(str(wheels))
    version = str(parse_wheel_filename(own)[1])
    fetch(wheels)
    add_pycairo_stub(wheels)
    add_materialyoucolor_for_arm(wheels)
    texts = {
        "requirements.txt": requirements(wheels, version),
        "sbom.cdx.json": json.dumps(sbom(wheels, datetime.fromtimestamp(int(stamp), UTC)), indent=1) + "\n",
        "INSTALL.md": (ROOT / "packaging" / "INSTALL.md").read_text(encoding="utf-8"),
    }
    for name, text in texts.items():
        (out / name).write_text(text, encoding="utf-8", newline="\n")
    sums = [
        f"{sum_of(path)}  {path.relative_to(out).as_posix()}\n" for path in sorted(out.rglob("*")) if path.is_file()
    ]
    (out / "SHA256SUMS").write_text("".join(sums), encoding="utf-8", newline="\n")


def main() -> int:
    options = argparse.ArgumentParser(description="Makes the folder that an installation needs.", allow_abbrev=False)
    options.add_argument("out", type=Path, metavar="OUT", help="a folder that does not exist yet")
    out = options.parse_args().out.absolute()
    if out.exists():
        print(f"release.py: {out} exists: remove it, or name another folder", file=sys.stderr)
        return 2
    part = out.with_name(f"{out.name}.part")  # OUT is whole or not there
    shutil.rmtree(part, ignore_errors=True)
    try:
        make(part)
        part.rename(out)
    except subprocess.CalledProcessError as error:
        print(
            f"release.py: {re.sub(r'^.*/', '', error.cmd[0])} failed, see above; {part} is not whole", file=sys.stderr
        )
        return 1
    except OSError as error:
        print(f"release.py: {error}; {part} is not whole", file=sys.stderr)
        return 1
    size = sum(path.stat().st_size for path in out.rglob("*"))
    print(f"{out}: {len(list((out / 'wheels').iterdir()))} wheels, {size / 1e6:.0f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
