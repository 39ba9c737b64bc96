"""A file that one process has for itself."""

from __future__ import annotations

from typing import BinaryIO


def lock(file: BinaryIO) -> bool:
    """Lock a file until it is closed; return False if another process holds the lock.

    The lock ends with the process, also when it is killed. Where there are no locks, as on some
    network file systems, it is True.
    """
    try:
        import fcntl
    except ImportError:  # not of POSIX
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
