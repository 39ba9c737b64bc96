"""How large what is read may be: each bound once, with its reason.

A recording of hours at 10 kHz must pass. What is larger than any real file is refused before it
takes the memory or the time of the computer, whether it is damaged, mistaken or made on purpose.
"""

from __future__ import annotations

from collections.abc import Sequence

MIB = 2**20

RECORDING_BYTES = 8192 * MIB
"""Of a recording: 5 h at 10 kHz in 5 columns of numbers with 8 digits is 8 GB as text."""

TABLE_BYTES = 32 * MIB
"""Of a small table, such as sessions, ratings or estimates: 100,000 rows of 300 characters."""

DOCUMENT_BYTES = 32 * MIB
"""Of a JSON file: 10,000 estimated epochs take 30 MB. Parsed, JSON takes up to 25 times as much."""

ESTIMATES_BYTES = 512 * MIB
"""Of estimates as JSON: 170,000 epochs; what is larger is not written."""

SETTINGS_BYTES = 1 * MIB
"""Of a TOML file: all settings with their remarks take 20 kB."""

NESTING = 32
"""Tables or lists within one another; the deepest document written here has 7."""

MAX_DIGITS = 40
"""Of a whole number: a seed of 128 bits has 39."""

MAX_COLUMNS = 2_000
"""Of a table or entries of an archive: a BIDS or EMG file has some hundred channels."""

TABLE_ROWS = 100_000
"""Of a small table: 10,000 epochs by ten measures."""

TABLE_CELLS = 2_000_000
"""Of a small table, rows times columns: text takes about 100 bytes a cell."""

MAX_EPOCHS = 10_000
"""Of one recording, pieces between gaps included: 8 h of epochs of 3 s."""

CELLS = 200_000
"""Cells and fields of a MATLAB file: each is an object, read by itself in 20 to 100 µs."""

SAMPLING_RATE_HZ = (1e-3, 1e7)
"""Lowest and highest: below is no motion, above no sensor of torque or angle."""

MAGNITUDE = (1e-30, 1e30)
"""Smallest and largest amplitude of a channel in SI units: its fourth power and the reciprocal of
that must be a double (1e-308 to 1e308), with room for sums."""

EXPANDED_BYTES = 128 * MIB
"""What the compressed entries of an archive that are used may hold in any case, expanded."""

EXPANSION = 100
"""How many times the size of its file they may hold beyond that. Measured signals shrink by 2 to 20
times; a file of zeros, as an archive made to fill the memory is, by 1,000 times."""

SCORES_BY_GROUPS_SQUARED = 3e9
"""Of a mixed model, scores times the square of the groups, which its time grows with: about 10 s.
It is 10,000 ratings by 500 examiners, or 100,000 by 170."""

BOOTSTRAP_COUNTS = 25_000_000
"""Of a bootstrap, resamples times units, each 16 bytes: 9,999 resamples of 2,500 units."""

RANKED_PAIRS = 50_000_000
"""Of a rank-sum test, whose shift is the median of all differences: 7,000 values a condition."""

SHOWN_LINES = 5
"""Of the lines that one sentence is about; the others are counted."""

MAX_NOTICES = 20
"""Of one kind about the rows of one table; the others are counted."""


def size_text(n_bytes: float) -> str:
    """Return a size for a message, as in ``1.5 GiB``.

    Examples
    --------
    >>> size_text(32 * MIB)
    '32 MiB'
    """
    for unit, factor in (("GiB", 2**30), ("MiB", MIB), ("KiB", 2**10)):
        if n_bytes >= factor:
            return f"{n_bytes / factor:.3g} {unit}"
    return f"{n_bytes:.0f} bytes"


def lines_text(lines: Sequence[int]) -> str:
    """Return lines of a file for a message: the first, and how many more.

    Examples
    --------
    >>> lines_text([3]), lines_text([3, 4, 5, 8, 9, 11, 12])
    ('line 3', 'lines 3, 4, 5, 8, 9 and 2 more')
    """
    shown = ", ".join(map(str, lines[:SHOWN_LINES]))
    more = f" and {len(lines) - SHOWN_LINES} more" if len(lines) > SHOWN_LINES else ""
    return f"line{'' if len(lines) == 1 else 's'} {shown}{more}"
