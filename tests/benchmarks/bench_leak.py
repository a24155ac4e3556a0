"""What a thousand screens, a thousand dialogs and some hundred sizes of the window leave behind, in the window without a display.

    uv run python -m tests.benchmarks.bench_leak [count] [--kinds]

Printed for each: memory that the process has resident, after a collection of garbage, when the first hundred are over and at the end of
``count`` (1,000; of sizes 300), and the most between; then counts before and after of all of it (widgets, kv's rules and bindings, who
follows theme and language). With ``--kinds`` also the classes of objects that became more. What grows with the count leaks.
"""

from __future__ import annotations

import argparse
import gc
import logging
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from tests.ui import headless

WARM = 72  # rounds: every screen, section and dialog has been built, every cache filled
FIRST = 100
SIZES = 300
LOOK = 20  # between two looks at the memory
PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_leak")
    options.add_argument("count", type=int, nargs="?", default=1000)
    options.add_argument("--kinds", action="store_true")
    args = options.parse_args()
    logging.getLogger("kivy").addHandler(logging.NullHandler())  # missing clipboards of this machine are not logged
    logging.getLogger("kivy").propagate = False
    headless.install()
    from app.window.window import quiet_garbage
    from tests.support import month
    from tests.ui.driver import Driver
    from tests.ui.wear import Wear, kinds, widgets
    from tests.ui.whole_app import shown

    with tempfile.TemporaryDirectory() as directory:
        container = month.plant(Path(directory), True)
        with shown(container, Driver()) as app, quiet_garbage():
            wear = Wear(app, Driver())
            wear.rounds(WARM)
            gc.unfreeze()
            counts, classes, kinds_of_widgets = wear.counts(), kinds(), widgets()
            print(f"{'resident, MiB':<36} {'after 100':>9} {'at end':>9} {'growth':>8} {'most':>8}")
            for name, count, step in (
                ("screens", args.count, wear.switch),
                ("dialogs", args.count, wear.dialog),
                ("sizes", min(args.count, SIZES), wear.resize),
            ):
                wear_out(f"{count} {name}", count, step, wear.settle)
            print(f"\n{'alive':<36} {'before':>9} {'after':>9} {'growth':>8}")
            for name, now in wear.counts().items():
                print(f"{name:<36} {counts[name]:>9} {now:>9} {now - counts[name]:>+8}")
            if args.kinds:
                print("\nclasses of which there are more:")
                for name, more in (kinds() - classes).most_common(15):
                    print(f"  {name:<60} {classes[name]:>8} +{more}")
                for name, more in (widgets() - kinds_of_widgets).most_common(10):
                    print(f"  widget {name:<53} {kinds_of_widgets[name]:>8} +{more}")
        container.close()


def wear_out(name: str, count: int, step: Callable[[], object], settle: Callable[[], object]) -> None:
    first = most = 0.0
    for n in range(1, count + 1):
        step()
        if n % LOOK == 0:
            most = max(most, resident())
        if n == min(FIRST, count):
            first = settled(settle)
    end = settled(settle)
    print(f"{name:<36} {first:>9.1f} {end:>9.1f} {end - first:>+8.1f} {most:>8.1f}", flush=True)


def settled(settle: Callable[[], object]) -> float:
    gc.unfreeze()
    settle()
    return resident()


def resident() -> float:
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * PAGE_MIB


if __name__ == "__main__":
    main()
