"""The samples of a running loop, looked at from another process."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigidimeter.rig.acquisition.processes import ROW, WHERE

WRITTEN_WORD = 8  # of a ring's header
HEADER_BYTES = 512


class Ring:
    """The loop's ring of samples, looked at from outside without holding it."""

    def __init__(self, stem: str) -> None:
        self._stem = stem
        self._bytes: NDArray[np.uint8] = np.memmap(WHERE / f"{stem}-samples", np.uint8, "r")

    def left(self) -> list[Path]:
        """Return what is left of the session in shared memory."""
        return sorted(WHERE.glob(f"{self._stem}-*"))

    @property
    def written(self) -> int:
        return int(self._bytes[: 8 * (WRITTEN_WORD + 1)].view(np.int64)[WRITTEN_WORD])

    def newest(self) -> np.void:
        """Return the newest sample."""
        rows = self._bytes[HEADER_BYTES:].view(ROW)
        newest: np.void = rows[(self.written - 1) % rows.size]
        return newest
