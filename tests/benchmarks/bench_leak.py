"""What a thousand screens and dialogs leave behind, in the window without a display.

    uv run python -m tests.benchmarks.bench_leak [rounds] [--memory]

A round is one screen and one dialog, so 500 rounds are 1,000 of them. Printed: counts before and after (widgets, kv's rules and bindings,
who follows theme and language), the classes of objects that became more and, with ``--memory``, which takes several times as long, where
the memory was taken. What grows with the rounds leaks.
"""
from __future__ import annotations

import argparse
import logging
import tempfile
import tracemalloc
from pathlib import Path

from tests.ui import headless

WARM = 72                                # rounds: every screen, section and dialog has been built, every cache filled


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_leak")
    options.add_argument("rounds", type=int, nargs="?", default=500)
    options.add_argument("--memory", action="store_true")
    given = options.parse_args()
    rounds = given.rounds
    logging.getLogger("kivy").addHandler(logging.NullHandler())      # which clipboards this machine lacks is no news here
    logging.getLogger("kivy").propagate = False
    headless.install()
    from tests.support import month
    from tests.ui.driver import Driver
    from tests.ui.wear import Wear, kinds, widgets
    from tests.ui.whole_app import shown

    with tempfile.TemporaryDirectory() as directory:
        container = month.plant(Path(directory), True)
        with shown(container, Driver()) as app:
            wear = Wear(app, Driver())
            wear.rounds(WARM)
            counts, classes, kinds_of_widgets = wear.counts(), kinds(), widgets()
            if given.memory:
                tracemalloc.start()
                memory = tracemalloc.take_snapshot()
            for n in range(0, rounds, WARM):
                wear.rounds(min(WARM, rounds - n))
            print(f"{'after ' + str(2 * rounds) + ' screens and dialogs':<36} {'before':>9} {'after':>9} {'growth':>8}")
            for name, now in wear.counts().items():
                print(f"{name:<36} {counts[name]:>9} {now:>9} {now - counts[name]:>+8}")
            print("\nclasses of which there are more:")
            for name, count in (kinds() - classes).most_common(15):
                print(f"  {name:<60} {classes[name]:>8} +{count}")
            for name, count in (widgets() - kinds_of_widgets).most_common(10):
                print(f"  widget {name:<53} {kinds_of_widgets[name]:>8} +{count}")
            if given.memory:
                tell_memory(memory, tracemalloc.take_snapshot())
        container.close()


def tell_memory(before: tracemalloc.Snapshot, after: tracemalloc.Snapshot) -> None:
    print("\nmemory taken since, by line:")
    growth = sorted(after.compare_to(before, "lineno"), key=lambda line: -line.size_diff)
    print(f"  all together {sum(line.size_diff for line in growth) / 1024:+.0f} KiB")
    for line in growth[:15]:
        frame = line.traceback[0]
        place = "/".join(Path(frame.filename).parts[-3:])
        print(f"  {line.size_diff / 1024:>+8.1f} KiB {line.count_diff:>+7}  {place}:{frame.lineno}")


if __name__ == "__main__":
    main()
