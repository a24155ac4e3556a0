"""``python -m tests.screenshots DIR [name …]``: see the package."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from app.i18n import languages
from tests.screenshots.registry import DOCUMENTED, SIZES, THEMES
from tests.screenshots.studio import take_pictures

STANDARD = ("landscape", "portrait")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.screenshots", description="PNGs of every screen and dialog.")
    parser.add_argument("directory", type=Path)
    parser.add_argument("names", nargs="*", help="pictures to take (default: all)")
    parser.add_argument(
        "--size", action="append", choices=list(SIZES), help=f"window (default: {' and '.join(STANDARD)})"
    )
    parser.add_argument("--theme", action="append", choices=THEMES, help="theme (default: all)")
    parser.add_argument("--language", choices=list(languages()), default="en")
    parser.add_argument("--documented", action="store_true", help="what docs/screens shows, instead")
    parser.add_argument("--in-this-process", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    out = options.directory.resolve()
    out.mkdir(parents=True, exist_ok=True)
    themes = options.theme or list(THEMES)
    if options.in_this_process:
        failed = take_pictures(out, SIZES[options.size[0]], options.names, themes, options.language)
        sys.stdout.flush()
        os._exit(bool(failed))  # SDL's own clean-up has nothing to do and may hang without a display
    wanted = [(size, options.language, options.names, themes) for size in options.size or STANDARD]
    if options.documented:
        wanted = [(size, language, list(names), [theme]) for size, theme, language, names in DOCUMENTED]
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:  # kivy has one window, of one size, per process
        return max(pool.map(lambda each: _in_a_process(out, *each), wanted))


def _in_a_process(out: Path, size: str, language: str, names: list[str], themes: list[str]) -> int:
    command = [
        sys.executable,
        "-m",
        "tests.screenshots",
        str(out),
        *names,
        "--in-this-process",
        "--size",
        size,
        "--language",
        language,
    ]
    command += [word for theme in themes for word in ("--theme", theme)]
    with tempfile.TemporaryDirectory(prefix="amr-pictures-") as temporary:  # it ends too abruptly to tidy up
        return subprocess.run(
            command, check=False, cwd=Path(__file__).parents[2], env={**os.environ, "TMPDIR": temporary}
        ).returncode


if __name__ == "__main__":
    sys.exit(main())
