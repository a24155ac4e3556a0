"""The app on a real Windows Python, which wine runs on Linux: ``tests/windows/run``.

The Python is python.org's own DLLs, as panda3d's wheel brings them, with the library of a CPython 3.12 of this machine. All of it is on
drive C: of a wine prefix that is removed afterwards: from drive Z: programs would see this machine's /etc. Without wine, or without
such a library, one sentence says so and nothing is tested. Drivers, touch, DPI, sleep and virus scanners are not tested here.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

from PIL import Image

from tests.windows.screen import Screen

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
SIZES = ((1366, 768), (1280, 800))  # px, of two tablets' displays
NEEDED = ("wine", "wineserver", "Xvfb", "x86_64-w64-mingw32-gcc", "uv")
LEAST_CHECKS, LEAST_KILLS, LEAST_UNITS = 15, 38, 3500  # that have to pass
LEAST_COLOURS = 1000  # of a picture with text and icons; without the screens it has a hundred
SLOW = ("catalogue", "database", "planning", "screens", "sim")  # are begun first
INSTALL = (
    *("uv", "pip", "install", "--quiet", "--no-deps", "--require-hashes", "--only-binary", ":all:"),
    *("--python-platform", "windows", "--python-version", "3.12"),
)
NOT_WINDOWS = shutil.ignore_patterns("site-packages", "lib-dynload", "test", "idlelib", "__pycache__", "config-*")
LAUNCHER = """#include <windows.h>
int wmain(int count, wchar_t **words) {
    return ((int (*)(int, wchar_t **))(void *)GetProcAddress(LoadLibraryW(L"python312.dll"), "Py_Main"))(count, words);
}
"""
ON_WINE = """import _winapi
if hasattr(_winapi, "CopyFile2"):
    del _winapi.CopyFile2  # wine 8 has none
"""


class Missing(Exception):
    """Why nothing can be tested here."""


class Failed(Exception):
    """What did not hold."""


class Windows:
    """Drive C: with Python and the app, below ``home``."""

    def __init__(self, home: Path) -> None:
        self.drive = home / "prefix" / "drive_c"
        mine = {"HOME": str(home), "WINEPREFIX": str(home / "prefix"), "WINEARCH": "win64", "WINEDEBUG": "-all"}
        mine["WINEDLLOVERRIDES"] = "winedbg.exe=d;mscoree=;mshtml="  # no debugger's window, no questions about Mono
        mine["PYTEST_DEBUG_TEMPROOT"] = r"C:\temp"  # wine shows /dev/shm to some calls only
        self._environ = {name: value for name, value in os.environ.items() if name not in ("TZ", "DISPLAY")} | mine

    def build(self, library: Path) -> None:
        for name in ("app", "temp"):
            (self.drive / name).mkdir(parents=True)
        with ThreadPoolExecutor() as pool:
            for done in [
                pool.submit(self._make_prefix),
                pool.submit(self._make_python, library),
                pool.submit(_copy_app, self.drive / "app"),
            ]:
                done.result()

    def _make_prefix(self) -> None:
        """With a memory stick at E:."""
        stick = self.drive / "stick"
        stick.mkdir()
        (stick / ".windows-label").write_text("STICK\n", encoding="ascii")
        self.finish(self.start("wineboot", "--init"), within=200)
        (self.drive.parent / "dosdevices" / "e:").symlink_to("../drive_c/stick")
        self.add_value(r"HKLM\Software\Wine\Drives", "e:", "floppy")
        self.stop()  # it reads its drives when it starts

    def _make_python(self, library: Path) -> None:
        python, packages = self.drive / "python", self.drive / "python" / "Lib" / "site-packages"
        shutil.copytree(library, python / "Lib", ignore=NOT_WINDOWS)
        for wanted in (ROOT / "packaging" / "requirements.txt", HERE / "requirements.txt"):
            _run(*INSTALL, "--target", packages, "--requirement", wanted)
        shutil.move(packages / "share", python)  # SDL, where pip puts what belongs below sys.prefix
        brought = packages / "deploy_libs"
        (brought / "_wmi.pyd").unlink()  # it would hang: wine 8 has no propsys.VariantToString
        for file in [
            packages / "panda3d" / "MSVCP140.dll",
            *brought.glob("python*.dll"),
            *brought.glob("VCRUNTIME*.dll"),
        ]:
            shutil.move(file, python)
        for file in brought.glob("api-ms-*.dll"):
            file.unlink()  # wine has its own
        shutil.move(brought, python / "DLLs")
        for unneeded in ("panda3d", "panda3d_tools", "direct", "pandac"):
            shutil.rmtree(packages / unneeded)
        (packages / "sitecustomize.py").write_text(ON_WINE, encoding="ascii")
        source = python / "python.c"
        source.write_text(LAUNCHER, encoding="ascii")
        _run("x86_64-w64-mingw32-gcc", "-municode", "-O1", "-o", python / "python.exe", source)

    def start(self, *words: str, screen: Screen | None = None) -> subprocess.Popen[str]:
        """A process in the app's directory. It writes into a pipe: wine does not hand over files of this machine."""
        return subprocess.Popen(
            ["wine", *words],
            cwd=self.drive / "app",
            env=self._environ | ({"DISPLAY": screen.name} if screen else {}),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
        )

    def python(self, *words: str, screen: Screen | None = None) -> subprocess.Popen[str]:
        return self.start(r"C:\python\python.exe", "-X", "utf8", *words, screen=screen)

    def finish(self, process: subprocess.Popen[str], within: float) -> str:
        """What it wrote. Raises Failed after so many seconds, or if it ended with an error."""
        lines: list[str] = []
        reader = threading.Thread(target=lambda: lines.extend(process.stdout or ()), daemon=True)
        reader.start()
        try:
            code = process.wait(within)
        except subprocess.TimeoutExpired:
            process.kill()
            code = None
        reader.join(5)  # wine's own programs may have the pipe for longer
        output = "".join(lines)
        if code != 0:
            how = f"did not end within {within} s" if code is None else f"ended with {code}"
            raise Failed(f"{process.args!r} {how}:\n{output[-5000:]}")
        return output

    def add_value(self, key: str, name: str, value: str) -> None:
        """To its registry."""
        self.finish(self.start("reg", "add", key, "/v", name, "/d", value, "/f"), within=60)

    def stop(self) -> None:
        subprocess.run(["wineserver", "--kill"], env=self._environ, check=False, stderr=subprocess.DEVNULL)


def _run(*words: object) -> None:
    subprocess.run([str(word) for word in words], check=True)


def _copy_app(target: Path) -> None:
    names = subprocess.run(
        ["git", "ls-files", "-coz", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True, text=True
    )
    for name in filter(None, names.stdout.split("\0")):
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, target / name)


# ---------------------------------------------------------------------- the parts
def start(windows: Windows, home: Path) -> None:
    """Starts, stops, two processes, a restored backup, and what Windows says about itself: checks.py, on Windows."""
    with closing(Screen(SIZES[0], home / "screen")) as screen:
        _at_least(LEAST_CHECKS, [_tested(windows, screen, "tests/windows/checks.py")])


def kills(windows: Windows, home: Path) -> None:
    """Kills, and the other tests of real processes."""
    with closing(Screen(SIZES[0], home / "kills")) as screen:
        _at_least(LEAST_KILLS, [_tested(windows, screen, "-m", "", "tests/services/test_real_process.py")])


def _tested(windows: Windows, screen: Screen, *words: str) -> str:
    """What pytest said. Raises Failed."""
    began = time.monotonic()
    tests = windows.python(
        "-m", "pytest", "-n", "0", "--tb=short", "-p", "tests.windows.excused", *words, screen=screen
    )
    output = windows.finish(tests, within=600)
    print(f"{words[-1]}: {output.splitlines()[-1]} ({time.monotonic() - began:.0f} s)", flush=True)
    return output


def window(windows: Windows, home: Path) -> None:
    """On each display, whose desktop is wine's own, the window is drawn whole."""
    windows.add_value(r"HKCU\Software\Wine\Explorer", "Desktop", "tablet")
    for width, height in SIZES:
        windows.add_value(r"HKCU\Software\Wine\Explorer\Desktops", "tablet", f"{width}x{height}")
        windows.stop()
        with closing(Screen((width, height), home / f"{width}x{height}")) as screen:
            app = windows.python("main.py", "--demo", screen=screen)
            try:
                picture = _drawn(screen, within=150)
            finally:
                windows.stop()
                app.communicate(timeout=20)
        picture.save(home / f"windows-{width}x{height}.png")
        print(f"{width}x{height}: drawn whole")


def _drawn(screen: Screen, within: float) -> Image.Image:
    """The picture when all of the app is on it: its colours, and none of the display's black at three of its edges."""
    end = time.monotonic() + within
    while True:
        picture = screen.picture()
        width, height = picture.size
        edges = [
            picture.getpixel(place) for place in ((0, height // 2), (width - 1, height // 2), (width // 2, height - 1))
        ]
        colours = len(picture.getcolors(1 << 24) or [])
        if colours > LEAST_COLOURS and edges.count(edges[0]) == len(edges) and edges[0] != (0, 0, 0):
            return picture
        if time.monotonic() > end:
            raise Failed(f"after {within} s the display has {colours} colours, and {edges} at its edges")
        time.sleep(1)


def units(windows: Windows, home: Path) -> None:
    """tests/unit, a process for each folder, two at a time."""
    found = (
        path for path in (ROOT / "tests" / "unit").iterdir() if path.match("test_*.py") or any(path.glob("test_*.py"))
    )
    names = sorted((path.name for path in found), key=lambda name: (name not in SLOW, name))
    with closing(Screen(SIZES[0], home / "units")) as screen, ThreadPoolExecutor(2) as pool:
        results = [pool.submit(_tested, windows, screen, f"tests/unit/{name}") for name in names]
    if failures := [str(failure) for result in results if (failure := result.exception())]:
        raise Failed("\n".join(failures))
    _at_least(LEAST_UNITS, [result.result() for result in results])


def _at_least(wanted: int, outputs: Sequence[str]) -> None:
    """Nothing passes by testing nothing."""
    passed = sum(int(number) for output in outputs for number in re.findall(r"(\d+) passed", output)[-1:])
    if passed < wanted:
        raise Failed(f"only {passed} tests passed, not {wanted}")
    print(f"{passed} tests passed")


PARTS: dict[str, Callable[[Windows, Path], None]] = {part.__name__: part for part in (start, kills, window, units)}


# ---------------------------------------------------------------------- the lane
def library() -> Path:
    """Of a CPython 3.12. Raises Missing."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    of_uv = _output("uv", "python", "find", "--no-python-downloads", "3.12")
    for python in (of_uv, *pyenv.glob("versions/3.12*/bin/python3.12"), shutil.which("python3.12")):
        if python and (found := _output(python, "-c", "import sysconfig; print(sysconfig.get_path('stdlib'))")):
            return Path(found)
    raise Missing("no CPython 3.12 is installed, whose library is needed")


def _output(*words: object) -> str:
    """Nothing of a program that fails."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    return "" if done.returncode else done.stdout.strip()


def main() -> int:
    options = argparse.ArgumentParser(prog="tests/windows/run", description=(__doc__ or "").partition("\n")[0])
    options.add_argument(
        "parts", nargs="*", choices=[[], *PARTS], metavar="PART", help=f"{', '.join(PARTS)} (default: all)"
    )
    options.add_argument("--pictures", type=Path, metavar="DIR", help="keep the pictures of windows here")
    arguments = options.parse_args()
    try:
        if missing := [name for name in NEEDED if shutil.which(name) is None]:
            raise Missing(f"{' and '.join(missing)} missing")
        found = library()
    except Missing as why:
        print(f"NOT TESTED on Windows: {why}")
        return 0
    home = Path(tempfile.mkdtemp(prefix="amr-windows-"))
    windows, began = Windows(home), time.monotonic()
    try:
        windows.build(found)
        for part in arguments.parts or PARTS:
            print(f"-- {part} ({time.monotonic() - began:.0f} s)", flush=True)
            PARTS[part](windows, home)
    except Failed as failure:
        print(f"FAILED on Windows: {failure}", file=sys.stderr)
        return 1
    finally:
        windows.stop()
        for picture in home.glob("windows-*.png") if arguments.pictures else ():
            shutil.copy(picture, arguments.pictures)
        shutil.rmtree(home, ignore_errors=True)
    print(f"-- done ({time.monotonic() - began:.0f} s)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
