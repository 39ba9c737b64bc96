"""Missing samples: lost ones, gaps, and sensors that are only slower.

All channels are placed on one clock, the union of theirs: a row is a time at which any of them has
a sample. A column may be filled only on every k-th row, or on rows of its own among those of other
sensors. Its own time stamps show which: if its intervals are regular without the empty rows,
nothing was lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.clock import seconds
from rigidimeter.analysis.reading_anew.columns import Array
from rigidimeter.core.records import Notice
from rigidimeter.core.words import plural

BRIDGED_CYCLES = 0.36
"""f T of the longest pause that is bridged. A cubic through samples T apart follows a sinusoid of
f Hz to (2π f T)⁴/384 of its amplitude, 0.07 here: of the fastest component a few per cent are lost
in pauses so long, of all others less."""
FASTEST_ABOVE = 0.98
"""Of the power of a signal lies below its fastest component."""
LONGEST_BRIDGED_S = 0.25
"""A pause that is longer is one, however slow the motion."""
_PIECE_S = 4.0
_LONGEST_STEPS = 3.0
_LONGEST_S = 0.05
_REGULAR = 1.5
_SHOWN = 3
_ROUNDING_S = 1e-6  # of stamps as large as the seconds since 1970


@dataclass(frozen=True)
class Rows:
    """The clock of all channels, its typical interval, and its gaps.

    `gaps` are the rows before a gap, `lost_s` how long the gaps are up to and with each of them,
    beyond an interval. Intervals of up to `bridged_s` are none, however fast the samples are.
    """

    time_s: Array
    step_s: float
    gaps: NDArray[np.intp]
    lost_s: Array
    bridged_s: float = 0.0

    @classmethod
    def of(cls, time_s: Array, bridged_s: float = 0.0) -> Rows:
        """Measure a clock of two or more stamps."""
        steps = np.diff(time_s)
        step_s = float(np.median(steps))
        gaps = np.flatnonzero(steps > longest_s(step_s, bridged_s))
        return cls(time_s, step_s, gaps, np.cumsum(steps[gaps] - step_s), bridged_s)

    def in_gaps_s(self, rows: NDArray[np.intp]) -> Array:
        """Return how much of the time up to each row is due to gaps."""
        before = np.searchsorted(self.gaps, rows)
        return np.concatenate(([0.0], self.lost_s))[before]


@dataclass(frozen=True)
class Track:
    """The samples of one channel on the clock of all, without the rows in which it has none.

    `rows` are the rows it is present in (None: in all), `infinite` those in which it is not finite,
    `step_s` is its own median interval, and `own_rows` says that its empty rows are another
    sensor's.
    """

    name: str
    rows: NDArray[np.intp] | None
    time_s: Array
    values: Array
    infinite: NDArray[np.intp]
    step_s: float
    own_rows: bool

    def within(self, start: int, stop: int) -> slice:
        """Return the samples that lie in rows `start` to `stop` (not included)."""
        if self.rows is None:
            return slice(start, stop)
        low, high = np.searchsorted(self.rows, [start, stop])
        return slice(int(low), int(high))


class Loss(NamedTuple):
    """A run of `n_samples` samples of a channel that should be there and are not."""

    n_samples: int
    start_s: float
    stop_s: float


class Break(NamedTuple):
    """An interval too long to bridge, between the rows `before` and `after`.

    `lost` says that the rows are there but the samples are not.
    """

    channel: str
    before: int
    after: int
    start_s: float
    stop_s: float
    lost: bool


def longest_s(step_s: float, bridged_s: float = 0.0) -> float:
    """Return the longest interval that is bridged, for samples that are `step_s` apart."""
    return max(_LONGEST_STEPS * step_s, _LONGEST_S, bridged_s) + _ROUNDING_S


def make_track(name: str, clock: Rows, own_s: Array, values: Array) -> Track:
    """Place the finite samples of a channel, with its stamps, on the clock of all."""
    finite = np.isfinite(values)
    own_clock = own_s is clock.time_s or np.array_equal(own_s, clock.time_s)
    if own_clock and np.all(finite):
        return Track(name, None, clock.time_s, values, np.empty(0, np.intp), clock.step_s, False)
    at = np.arange(own_s.size) if own_clock else np.searchsorted(clock.time_s, own_s)
    rows, infinite = at[finite], at[np.isinf(values)]
    time_s = clock.time_s[rows]
    step_s = float(np.median(np.diff(time_s))) if rows.size > 1 else np.inf
    own_rows = 1 < rows.size < clock.time_s.size and _has_own_rows(clock, rows, step_s)
    return Track(name, rows, time_s, values[finite], infinite, step_s, own_rows)


def find_losses(track: Track, clock: Rows, start: int, stop: int) -> tuple[list[Loss], list[Break]]:
    """Return what a channel lacks in rows `start` to `stop`, and where it must be cut.

    The channel must have a sample there. At the two ends, where there is no neighbour, the first
    and last row stand for one.
    """
    limit_s = longest_s(track.step_s, clock.bridged_s)
    if track.rows is None:
        gaps = clock.gaps[(clock.gaps >= start) & (clock.gaps < stop - 1)]
        times = [(int(k), float(clock.time_s[k]), float(clock.time_s[k + 1])) for k in gaps]
        return [], [Break(track.name, k, k + 1, a, b, False) for k, a, b in times]
    rows = track.rows[track.within(start, stop)]
    # Each interval runs between two rows; the ends are those before the first and after the last.
    before = np.concatenate(([start - 1], rows))
    after = np.concatenate((rows, [stop]))
    low, high = np.maximum(before, start), np.minimum(after, stop - 1)
    whole_s = clock.time_s[high] - clock.time_s[low]
    net_s = whole_s - (clock.in_gaps_s(high) - clock.in_gaps_s(low))
    empty = after - before - 1
    lossy = empty > 0
    if track.own_rows:
        inner = np.ones(empty.size)
        inner[[0, -1]] = 0.0
        infinite = np.diff(np.searchsorted(track.infinite, [before + 1, after]), axis=0)[0] > 0
        lossy &= (net_s > _REGULAR * track.step_s) | infinite
        empty = np.maximum(np.rint(net_s / track.step_s - inner), 1).astype(np.int64)
    losses = [
        Loss(int(empty[k]), float(clock.time_s[before[k] + 1]), float(clock.time_s[after[k] - 1]))
        for k in np.flatnonzero(lossy)
    ]
    breaks = [
        Break(
            track.name,
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
    count = plural(sum(loss.n_samples for loss in every), "sample")
    span = f"{seconds(every[0].start_s)} to {seconds(every[-1].stop_s)}"
    lacking = [label for label, found in losses.items() if found]
    shown = ", ".join(lacking[:_SHOWN]) + (" and more" if len(lacking) > _SHOWN else "")
    text = (
        f"{source}: {column} has {count} missing or not finite, in {plural(len(every), 'run')} "
        f"from {span} (epoch {shown}); left out"
    )
    return [Notice("error", text)]


def about_breaks(
    source: str, label: str, breaks: Sequence[Break], pieces: Sequence[str], n_channels: int
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
        shown = []
        for (start_s, stop_s), gaps in list(chosen.items())[:_SHOWN]:
            names = " and ".join(gap.channel for gap in gaps)
            where = "all channels" if len(gaps) == n_channels else names
            span = f"from {seconds(start_s)} to {seconds(stop_s)}"
            shown.append(f"{seconds(stop_s - start_s)} {span} in {where}")
        more = f"; and {len(chosen) - _SHOWN} more" if len(chosen) > _SHOWN else ""
        what = "samples are missing for" if lost else "there is a gap of"
        text = f"{source}, epoch {label}: {what} {'; '.join(shown)}{more}; {_cut(label, pieces)}"
        notices.append(Notice("error" if lost else "warning", text))
    return notices


def _has_own_rows(clock: Rows, rows: NDArray[np.intp], step_s: float) -> bool:
    if step_s > _REGULAR * clock.step_s:
        return True
    net_s = np.diff(clock.time_s[rows]) - np.diff(clock.in_gaps_s(rows))
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


def bridged_s(channels: Sequence[tuple[Array, Array]]) -> float:
    """Return the longest interval between samples that need not be cut, 0 where it is not known.

    Parameters
    ----------
    channels : sequence of (array, array)
        Time in s and values of torque and motion, without NaN.
    """
    with np.errstate(all="ignore"):  # of numbers that are refused elsewhere
        fastest_hz = [_fastest_hz(time_s, values) for time_s, values in channels]
    if not fastest_hz or not all(hz > 0 for hz in fastest_hz):
        return 0.0
    return min(BRIDGED_CYCLES / max(fastest_hz), LONGEST_BRIDGED_S)


def _fastest_hz(time_s: Array, values: Array) -> float:
    """Return the frequency below which nearly all of a signal is, of its longer pieces; or 0."""
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else 0.0
    count = int(_PIECE_S / step_s) if step_s > 0 else 0
    power: Array | None = None
    hz = np.empty(0)
    for rows in np.split(
        np.arange(time_s.size), np.flatnonzero(np.diff(time_s) > LONGEST_BRIDGED_S) + 1
    ):
        n_even = int((time_s[rows[-1]] - time_s[rows[0]]) / step_s) if step_s > 0 else 0
        if count < 16 or n_even < count:
            continue
        clock = time_s[rows[0]] + step_s * np.arange(n_even)
        even = scipy.interpolate.CubicSpline(time_s[rows], values[rows])(clock)
        hz, of_piece = scipy.signal.welch(even, 1.0 / step_s, nperseg=count)
        power = of_piece * n_even + (0.0 if power is None else power)
    if power is None or not np.sum(power) > 0:
        return 0.0
    return float(hz[int(np.searchsorted(np.cumsum(power), FASTEST_ABOVE * np.sum(power)))])
