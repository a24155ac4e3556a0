"""The commands ``amr-scheduler`` (also ``python -m amr_scheduler``) and ``mir-sim``."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # before any other package that is named app or main


def scheduler() -> int:
    sys.argv[0] = "amr-scheduler"  # `-m` has put the name of this file there, the .deb `-c`
    import main

    return main.main()


def simulator() -> int:
    sys.argv[0] = "mir-sim"
    from mir_sim.__main__ import main

    return main()


if __name__ == "__main__":
    sys.exit(scheduler())
