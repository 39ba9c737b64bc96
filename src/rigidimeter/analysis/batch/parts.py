"""What is done so far: one small file for each input in a folder beside the output.

Each is put in its place at once, under a name made of everything that its rows depend on. Nothing
else is kept of a run, so one that was killed at any moment goes on by looking for these names.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import json_text, lock, read_json, replace_file

Row = dict[str, Any]

_LOCK = "lock"


class Parts:
    """The folder of parts of one output; one process at a time has it.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    UserError
        If it cannot be made, or another process has it.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._held: dict[str, list[Row]] = {}
        with refused(folder, "cannot be written"):
            folder.mkdir(exist_ok=True)
            self._lock = (folder / _LOCK).open("wb")
        if not lock(self._lock):
            self._lock.close()
            raise UserError(
                f"{folder}: another batch writes the same output; wait for it, or name another file"
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._lock.close()

    def __contains__(self, key: str) -> bool:
        return key in self._held or self._place(key).exists()

    def put(self, key: str, rows: list[Row]) -> None:
        """Keep rows; in memory while the disk is full, for the output may still find room."""
        try:
            replace_file(self._place(key), json_text(rows).encode())
        except OSError:
            self._held[key] = rows

    def rows(self, key: str) -> list[Row]:
        """Return the rows that were put under a key.

        Raises
        ------
        UserError
            If the part is damaged.
        """
        found = self._held.get(key)
        return list(read_json(self._place(key))) if found is None else found

    def remove(self) -> None:
        """Remove the parts, and the folder if nothing else is in it."""
        with suppress(OSError):
            for path in (*self._folder.glob("*.json"), self._folder / _LOCK):
                path.unlink(missing_ok=True)
            self._folder.rmdir()

    def _place(self, key: str) -> Path:
        return self._folder / f"{key}.json"
