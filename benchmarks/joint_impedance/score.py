"""Score estimates of J, B and K against the truth: NumPy and the standard library alone.

    python score.py ESTIMATES.csv [TRUTH.csv]

The estimates have a row for each recording and the columns `scenario`, `recording`, `status` and,
for each of `inertia_kg_m2`, `damping_nm_s_rad` and `stiffness_nm_rad`, the value and the ends of
its 95 % interval, `…_low` and `…_high`. A cell may be empty: a value that is not given is withheld,
and an interval that is not given is not counted. README.md says what each status
means and how a score is defined.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

PARAMETERS = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
STATUSES = USED, CAUTION, WITHHELD = "used", "caution", "withheld"
OFF = 0.10
"""An error beyond this share of the truth is off."""

Row = Mapping[str, str]


class Score(NamedTuple):
    """Of one package in one scenario; arrays have one number for each of J, B and K.

    Attributes
    ----------
    recordings : int
    bias, scatter : array
        Median of the errors, and half of the distance between their 16th and 84th percentile, as
        shares of the truth.
    coverage : array
        Share of the intervals that hold the truth; NaN where none was given.
    half_width : array
        Median half-width of the intervals, as a share of the truth.
    caution, withheld : float
        Shares of the recordings.
    silent : float
        Share of the recordings in which J, B or K is off and the status is `used`.
    """

    recordings: int
    bias: NDArray[np.float64]
    scatter: NDArray[np.float64]
    coverage: NDArray[np.float64]
    half_width: NDArray[np.float64]
    caution: float
    withheld: float
    silent: float


def scores(estimates: Iterable[Row], truth: Iterable[Row]) -> dict[str, Score]:
    """Return the score of each scenario of which there are estimates, in the order of the truth.

    Raises
    ------
    ValueError
        If a row names no recording, names one a second time, or has a status that is not known.
    """
    true = {_key(row): row for row in truth}
    given: dict[tuple[str, int], Row] = {}
    for row in estimates:
        key = _key(row)
        if key not in true:
            raise ValueError(f"there is no recording {key[1]} of {key[0]!r}")
        if key in given:
            raise ValueError(f"recording {key[1]} of {key[0]!r} has two rows")
        if row["status"] not in STATUSES:
            raise ValueError(f"status {row['status']!r} is none of {', '.join(STATUSES)}")
        given[key] = row
    found: dict[str, list[tuple[Row, Row]]] = {name: [] for name, _ in true if _has(given, name)}
    for key, row in true.items():
        if key[0] in found:
            found[key[0]].append((given.get(key, {"status": WITHHELD}), row))
    return {name: _score(pairs) for name, pairs in found.items()}


def _key(row: Row) -> tuple[str, int]:
    return row["scenario"], int(row["recording"])


def _has(given: Iterable[tuple[str, int]], scenario: str) -> bool:
    return any(name == scenario for name, _ in given)


def _score(pairs: Sequence[tuple[Row, Row]]) -> Score:
    truth = _numbers([row for _, row in pairs], "")
    value, low, high = (_numbers([row for row, _ in pairs], end) for end in ("", "_low", "_high"))
    status = np.array([row["status"] for row, _ in pairs])
    withheld = (status == WITHHELD) | ~np.isfinite(value).all(axis=1)
    used = ~withheld & (status == USED)
    error = (value / truth - 1.0)[~withheld]
    half = ((high - low) / (2.0 * truth))[~withheld]
    held = ((low <= truth) & (truth <= high))[~withheld].astype(float)
    held[~np.isfinite(half)] = np.nan
    off = (np.abs(value / truth - 1.0) > OFF).any(axis=1)
    below, middle, above = (_percentile(error, one) for one in (16, 50, 84))
    return Score(
        len(pairs),
        middle,
        (above - below) / 2.0,
        np.array([_mean(column) for column in held.T]),
        _percentile(half, 50),
        float(np.mean(~withheld & (status == CAUTION))),
        float(np.mean(withheld)),
        float(np.mean(used & off)),
    )


def _numbers(rows: Sequence[Row], ending: str) -> NDArray[np.float64]:
    cells = [[row.get(name + ending) for name in PARAMETERS] for row in rows]
    return np.array([[float(cell) if cell else np.nan for cell in row] for row in cells])


def _percentile(values: NDArray[np.float64], percent: float) -> NDArray[np.float64]:
    columns = [column[np.isfinite(column)] for column in values.T]
    return np.array([np.percentile(one, percent) if one.size else np.nan for one in columns])


def _mean(values: NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if known.size else np.nan


def read(path: Path) -> list[dict[str, str]]:
    """Return the rows of a comma-separated table."""
    with path.open(encoding="utf-8", newline="") as file:
        return [*csv.DictReader(file)]


HEADING = (
    "bias J, B, K (%)", "scatter (%)", "coverage (%)", "half-width (%)",
    "caution, withheld (%)", "off, no caution (%)",
)  # fmt: skip


def cells(score: Score) -> list[str]:
    """Return a score as the cells of a table."""
    return [
        " ".join(_percent(value, "+") for value in score.bias),
        " ".join(_percent(value) for value in score.scatter),
        " ".join(_percent(value, whole=True) for value in score.coverage),
        " ".join(_percent(value) for value in score.half_width),
        f"{_percent(score.caution, whole=True)}, {_percent(score.withheld, whole=True)}",
        _percent(score.silent, whole=True),
    ]


def _percent(value: float, sign: str = "", *, whole: bool = False) -> str:
    if not np.isfinite(value):
        return "–"
    percent = 100.0 * value
    text = f"{percent:{sign}.{0 if whole or abs(percent) >= 9.95 else 1}f}"
    return text.replace("-", "−")


def main() -> None:
    """Print the scores of a file of estimates."""
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: score.py ESTIMATES.csv [TRUTH.csv]")
    truth = Path(sys.argv[2]) if len(sys.argv) == 3 else Path(__file__).with_name("truth.csv")
    try:
        found = scores(read(Path(sys.argv[1])), read(truth))
    except (OSError, KeyError, ValueError) as error:
        sys.exit(f"{sys.argv[1]}: {error}")
    print(" | ".join(("scenario", "recordings", *HEADING)))
    for name, score in found.items():
        print(" | ".join((name, str(score.recordings), *cells(score))))


if __name__ == "__main__":
    main()
