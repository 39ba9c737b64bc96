"""Missing samples: lost ones, gaps, and sensors that are only slower.

A column may be filled only on every k-th row, or on rows of its own among those of other sensors.
Its own time stamps show which: if its intervals are regular without the empty rows, nothing was
lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.columns import seconds
from rigidimeter.core.records import Notice

_LONGEST_STEPS = 3.0
_LONGEST_S = 0.05
_REGULAR = 1.5
_SHOWN = 3
_ROUNDING_S = 1e-6  # of stamps as large as the seconds since 1970


@dataclass(frozen=True)
class Rows:
    """The clock of a table, and how much of the time up to each row is due to its gaps.

    Intervals of up to `bridged_s` are none, however fast the samples are.
    """

    time_s: NDArray[np.float64]
    step_s: float
    in_gaps_s: NDArray[np.float64]
    bridged_s: float = 0.0

    @classmethod
    def of(cls, time_s: NDArray[np.float64], bridged_s: float = 0.0) -> Rows:
        """Measure a clock of two or more stamps."""
        step_s = _typical_step_s(time_s)
        steps = np.diff(time_s)
        excess = np.where(steps > longest_s(step_s, bridged_s), steps - step_s, 0.0)
        return cls(time_s, step_s, np.concatenate(([0.0], np.cumsum(excess))), bridged_s)


@dataclass(frozen=True)
class Signal:
    """The samples of one column, without the rows in which it has none.

    `rows` are the rows it is present in, `infinite` those in which it is not finite, `step_s` is
    its own median interval, and `own_rows` says that its empty rows are another sensor's.
    """

    name: str
    rows: NDArray[np.intp]
    time_s: NDArray[np.float64]
    values: NDArray[np.float64]
    infinite: NDArray[np.intp]
    step_s: float
    own_rows: bool

    def within(self, start: int, stop: int) -> slice:
        """Return the samples that lie in rows `start` to `stop` (not included)."""
        low, high = np.searchsorted(self.rows, [start, stop])
        return slice(int(low), int(high))


@dataclass(frozen=True)
class Loss:
    """A run of `count` samples of a signal that should be there and are not."""

    count: int
    start_s: float
    stop_s: float


@dataclass(frozen=True)
class Break:
    """An interval too long to bridge, between the rows `before` and `after`.

    `lost` says that the rows are there but the samples are not.
    """

    signal: str
    before: int
    after: int
    start_s: float
    stop_s: float
    lost: bool


def longest_s(step_s: float, bridged_s: float = 0.0) -> float:
    """Return the longest interval that is bridged, for samples that are `step_s` apart."""
    return max(_LONGEST_STEPS * step_s, _LONGEST_S, bridged_s) + _ROUNDING_S


def make_signal(name: str, clock: Rows, values: NDArray[np.float64]) -> Signal:
    """Take the samples of a column, shape (n,), that are finite."""
    finite = np.isfinite(values)
    rows = np.flatnonzero(finite)
    infinite = np.flatnonzero(np.isinf(values))
    time_s = clock.time_s if rows.size == values.size else clock.time_s[rows]
    step_s = _typical_step_s(time_s) if rows.size > 1 else np.inf
    kept = values if rows.size == values.size else values[rows]
    own_rows = 1 < rows.size < values.size and _has_own_rows(clock, rows, step_s)
    return Signal(name, rows, time_s, kept, infinite, step_s, own_rows)


def find_losses(
    signal: Signal, clock: Rows, start: int, stop: int
) -> tuple[list[Loss], list[Break]]:
    """Return what a signal lacks in rows `start` to `stop`, and where it must be cut.

    The signal must have a sample there. At the two ends, where there is no neighbour, the first
    and last row stand for one.
    """
    rows = signal.rows[signal.within(start, stop)]
    # Each interval runs between two rows; the ends are those before the first and after the last.
    before = np.concatenate(([start - 1], rows))
    after = np.concatenate((rows, [stop]))
    low, high = np.maximum(before, start), np.minimum(after, stop - 1)
    whole_s = clock.time_s[high] - clock.time_s[low]
    net_s = whole_s - (clock.in_gaps_s[high] - clock.in_gaps_s[low])
    empty = after - before - 1
    inner = np.ones(empty.size)
    inner[[0, -1]] = 0.0
    lossy = empty > 0
    if signal.own_rows:
        infinite = np.diff(np.searchsorted(signal.infinite, [before + 1, after]), axis=0)[0] > 0
        lossy &= (net_s > _REGULAR * signal.step_s) | infinite
        empty = np.maximum(np.rint(net_s / signal.step_s - inner), 1).astype(np.int64)
    losses = [
        Loss(int(empty[k]), float(clock.time_s[before[k] + 1]), float(clock.time_s[after[k] - 1]))
        for k in np.flatnonzero(lossy)
    ]
    limit_s = longest_s(signal.step_s, clock.bridged_s)
    breaks = [
        Break(
            signal.name,
            int(before[k]),
            int(after[k]),
            float(clock.time_s[low[k]]),
            float(clock.time_s[high[k]]),
            bool(net_s[k] > limit_s),
        )
        for k in np.flatnonzero(whole_s > limit_s)
    ]
    return losses, breaks


def kept_rows(start: int, stop: int, breaks: Iterable[Break]) -> list[tuple[int, int]]:
    """Return the pieces (start, stop) of some rows that lie outside all breaks."""
    pieces = []
    at = start
    for gap in sorted(breaks, key=lambda gap: (gap.before, gap.after)):
        if gap.before + 1 > at:
            pieces.append((at, gap.before + 1))
        at = max(at, gap.after)
    if at < stop:
        pieces.append((at, stop))
    return pieces


def about_losses(source: str, column: str, losses: Mapping[str, Sequence[Loss]]) -> list[Notice]:
    """Report the samples that one column lacks, by epoch, in one sentence."""
    every = [loss for found in losses.values() for loss in found]
    if not every:
        return []
    count = sum(loss.count for loss in every)
    start_s, stop_s = every[0].start_s, every[-1].stop_s
    when = (
        f"at {seconds(start_s)}" if count == 1 else f"from {seconds(start_s)} to {seconds(stop_s)}"
    )
    runs = f" in {len(every)} runs" if len(every) > 1 else ""
    lacking = [label for label, found in losses.items() if found]
    shown = ", ".join(lacking[:_SHOWN]) + (" and more" if len(lacking) > _SHOWN else "")
    one = count == 1
    text = (
        f"{source}: {column} has {count} sample{'' if one else 's'} missing or not finite, "
        f"{when}{runs} (epoch{'' if len(lacking) == 1 else 's'} {shown}); "
        f"{'it was' if one else 'they were'} left out"
    )
    return [Notice("error", text)]


def about_breaks(
    source: str, label: str, breaks: Sequence[Break], pieces: Sequence[str], n_signals: int
) -> list[Notice]:
    """Report where an epoch was cut: an error where samples are lost, else a warning."""
    notices = []
    spans: dict[tuple[float, float], list[Break]] = {}
    for gap in breaks:
        spans.setdefault((gap.start_s, gap.stop_s), []).append(gap)
    for lost in (True, False):
        chosen = {
            span: gaps
            for span, gaps in sorted(spans.items())
            if any(gap.lost for gap in gaps) is lost
        }
        if not chosen:
            continue
        shown = [
            f"{seconds(stop_s - start_s)} from {seconds(start_s)} to {seconds(stop_s)} in "
            + ("all channels" if len(gaps) == n_signals else " and ".join(g.signal for g in gaps))
            for (start_s, stop_s), gaps in list(chosen.items())[:_SHOWN]
        ]
        more = f"; and {len(chosen) - _SHOWN} more" if len(chosen) > _SHOWN else ""
        what = "samples are missing for" if lost else "there is a gap of"
        text = f"{source}, epoch {label}: {what} {'; '.join(shown)}{more}; {_cut(label, pieces)}"
        notices.append(Notice("error" if lost else "warning", text))
    return notices


def _typical_step_s(time_s: NDArray[np.float64]) -> float:
    """Return the median interval of two or more stamps, in s."""
    return float(np.median(np.diff(time_s)))


def _has_own_rows(clock: Rows, rows: NDArray[np.intp], step_s: float) -> bool:
    if step_s > _REGULAR * clock.step_s:
        return True
    net_s = np.diff(clock.time_s[rows]) - np.diff(clock.in_gaps_s[rows])
    skipped = np.diff(rows) > 1
    regular = int(np.count_nonzero(skipped & (net_s <= _REGULAR * step_s)))
    irregular = int(np.count_nonzero(skipped)) - regular
    return regular >= 3 and regular > irregular


def _cut(label: str, pieces: Sequence[str]) -> str:
    if not pieces:
        return "nothing of the epoch was read"
    if len(pieces) == 1:
        return f"epoch {label} was shortened to what lies outside"
    return f"the epoch was cut there into {len(pieces)}, {pieces[0]} to {pieces[-1]}"
