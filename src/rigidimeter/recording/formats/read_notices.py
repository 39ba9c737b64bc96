"""What is said about a recording that is read although something is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from rigidimeter.recording.formats.gaps import Break, Loss, Signal
from rigidimeter.recording.formats.stamps import seconds
from rigidimeter.records import Notice

__all__ = ["about_breaks", "about_losses", "about_units"]

_SHOWN = 3
_LARGEST_ANGLE_RAD = 2 * math.pi
_LARGEST_VELOCITY_RAD_S = 50.0
_LARGEST_EMG_V = 20.0
"""Amplifiers give at most ±10 V or so; more is another unit."""
_LARGEST_STEP_S = 0.5


def about_units(source: str, signals: Mapping[str, Signal], step_s: float) -> list[Notice]:
    """Warn of values that only make sense in degrees, in microvolts, or in milliseconds."""
    notices = []
    for name, signal in signals.items():
        if name == "angle_rad":
            limit, right = _LARGEST_ANGLE_RAD, "degrees: divide by 57.2958 to have rad"
        elif name.endswith("_rad_s"):
            limit, right = _LARGEST_VELOCITY_RAD_S, "degrees: divide by 57.2958 to have rad/s"
        elif name == "emg_v":
            limit, right = _LARGEST_EMG_V, "microvolts: divide by 1e6 to have V"
        else:
            continue
        largest = float(np.max(np.abs(signal.values)))
        if largest > limit:
            text = f"{source}: {name} reaches {largest:.4g}, which looks like {right}"
            notices.append(Notice("warning", text))
    if step_s > _LARGEST_STEP_S:
        text = (
            f"{source}: the rows are {seconds(step_s)} apart, which looks like milliseconds: "
            "divide by 1000 to have s"
        )
        notices.append(Notice("warning", text))
    return notices


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
        told = [
            f"{seconds(stop_s - start_s)} from {seconds(start_s)} to {seconds(stop_s)} in "
            + ("all channels" if len(gaps) == n_signals else " and ".join(g.signal for g in gaps))
            for (start_s, stop_s), gaps in list(chosen.items())[:_SHOWN]
        ]
        more = f"; and {len(chosen) - _SHOWN} more" if len(chosen) > _SHOWN else ""
        what = "samples are missing for" if lost else "there is a gap of"
        text = f"{source}, epoch {label}: {what} {'; '.join(told)}{more}; {_cut(label, pieces)}"
        notices.append(Notice("error" if lost else "warning", text))
    return notices


def _cut(label: str, pieces: Sequence[str]) -> str:
    if not pieces:
        return "nothing of the epoch was read"
    if len(pieces) == 1:
        return f"epoch {label} was shortened to what lies outside"
    return f"the epoch was cut there into {len(pieces)}, {pieces[0]} to {pieces[-1]}"
