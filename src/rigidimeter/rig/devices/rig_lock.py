"""A rig is for one program at a time, whatever its file is called.

What is locked is the hardware: the node on its bus, the sensor's address and serial number, the
serial port. For each there is a file in a folder of the machine that every user can write to; the
lock on it is held by an open descriptor, so it ends with the process, however that ends. The file
stays: removing it would let two programs lock two files of one name.

Another computer on the same bus or network is not seen.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import stat
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Self

from rigidimeter.core.errors import UserError

FOLDERS = (Path("/run/lock"), Path("/var/lock"), Path("/tmp"))
FOR_EVERYBODY = stat.S_ISVTX | stat.S_IWOTH
LONGEST_NOTE = 64


class RigLock:
    """Locks held by this process, until `close`.

    Parameters
    ----------
    rig : Path
        The rig file, for messages.
    """

    def __init__(self, rig: Path) -> None:
        self._rig = rig
        self._held: dict[str, int] = {}

    def take(self, names: Iterable[str]) -> None:
        """Lock all of these, or none of them and none of those before.

        Parameters
        ----------
        names : iterable of str
            What the rig consists of, such as "serial port /dev/ttyUSB0".

        Raises
        ------
        UserError
            If another process holds one of them; says which, and what process that is.
        """
        with ExitStack() as on_failure:
            on_failure.callback(self.close)
            for name in sorted({*names} - {*self._held}):
                self._held[name] = self._locked(name)
            on_failure.pop_all()

    def close(self) -> None:
        """Give everything back; safe when repeated."""
        while self._held:
            os.close(self._held.popitem()[1])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _locked(self, name: str) -> int:
        path = lock_path(name)
        try:
            file = _opened(path)
        except OSError as error:
            raise UserError(
                f"{path}: the lock of {name} cannot be opened ({error.strerror}); it must be a "
                "file that every user can read and write"
            ) from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = os.pread(file, LONGEST_NOTE, 0).decode("ascii", "replace").strip()
            os.close(file)
            who = f"process {holder}" if holder.isdigit() else "its process is not known"
            raise UserError(
                f"{self._rig}: another program uses this rig ({who}), locked by its {name}; end "
                "that one first"
            ) from None
        os.ftruncate(file, 0)
        os.pwrite(file, f"{os.getpid()}\n".encode(), 0)
        return file


def lock_path(name: str) -> Path:
    """Return the file whose lock stands for this; the same for all users of a machine.

    Raises
    ------
    UserError
        If there is no folder that every user can write to.
    """
    digest = hashlib.sha256(name.encode()).hexdigest()[:16]
    for folder in FOLDERS:
        if folder.is_dir() and folder.stat().st_mode & FOR_EVERYBODY == FOR_EVERYBODY:
            return folder / f"rigidimeter-{digest}.lock"
    raise UserError(
        f"the rig cannot be locked: none of {', '.join(map(str, FOLDERS))} is a folder that every "
        "user can write to (mode 1777)"
    )


def _opened(path: Path) -> int:
    # A file that another user made in such a folder may be opened, but not with leave to create it.
    flags = os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK
    try:
        file = os.open(path, flags)
    except FileNotFoundError:
        try:
            file = os.open(path, flags | os.O_CREAT | os.O_EXCL, 0o666)
            os.fchmod(file, 0o666)  # whatever the user's mask
        except FileExistsError:  # another was quicker
            file = os.open(path, flags)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(0, "it is no file")
    return file
