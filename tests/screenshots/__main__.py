"""``python -m tests.screenshots DIR [name …]``: see the package."""
from __future__ import annotations

import argparse
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.screenshots.registry import SIZES, THEMES
from tests.screenshots.studio import take_pictures

STANDARD = ("landscape", "portrait")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.screenshots", description="PNGs of every screen and dialog.")
    parser.add_argument("directory", type=Path)
    parser.add_argument("names", nargs="*", help="pictures to take (default: all)")
    parser.add_argument("--size", action="append", choices=list(SIZES), help=f"window (default: {' and '.join(STANDARD)})")
    parser.add_argument("--theme", action="append", choices=THEMES, help="theme (default: all)")
    parser.add_argument("--in-this-process", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    out = options.directory.resolve()
    out.mkdir(parents=True, exist_ok=True)
    sizes, themes = options.size or list(STANDARD), options.theme or list(THEMES)
    if options.in_this_process:
        failed = take_pictures(out, SIZES[sizes[0]], options.names, themes)
        sys.stdout.flush()
        os._exit(bool(failed))               # SDL's own clean-up has nothing to do and may hang without a display
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:        # kivy has one window, of one size, per process
        return max(pool.map(lambda size: _in_a_process(out, size, options.names, themes), sizes))


def _in_a_process(out: Path, size: str, names: list[str], themes: list[str]) -> int:
    command = [sys.executable, "-m", "tests.screenshots", str(out), *names, "--in-this-process", "--size", size]
    command += [word for theme in themes for word in ("--theme", theme)]
    return subprocess.run(command, check=False, cwd=Path(__file__).parents[2]).returncode


if __name__ == "__main__":
    sys.exit(main())
