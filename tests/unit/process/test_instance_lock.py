"""Who holds the lock is written down only where the disk has room for it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from app.process.data_directory import AlreadyRunning, InstanceLock


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit of file sizes")
def test_a_full_disk_does_not_keep_the_lock_from_being_taken_and_given_back(tmp_path: Path):
    import resource

    first, second = InstanceLock(tmp_path), InstanceLock(tmp_path)
    limit, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, most))  # each write fails, as on a full disk
    try:
        first.acquire()
        with pytest.raises(AlreadyRunning, match="in use by another process"):
            second.acquire()
        first.release()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most))
    second.acquire()
    with pytest.raises(AlreadyRunning, match=r"in use by process \d+ \("):
        first.acquire()
    second.release()
