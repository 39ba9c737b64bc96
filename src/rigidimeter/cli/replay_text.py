"""What `rigidimeter check --replay` says of a recorded session."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from rigidimeter.cli.output import echo
from rigidimeter.core.errors import UserError
from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.acquisition import NamedCause, Replay, replay_session


def say_replayed(folder: Path) -> None:
    """Replay a session and show what came of it.

    Raises
    ------
    UserError
        If the guard of this version decides otherwise, or no tick of the session can be read.
    """
    began_s = time.perf_counter()
    found = replay_session(folder)
    if not found.ticks:
        raise UserError(f"{folder}: no tick can be replayed: {found.left_out or 'there is none'}")
    for line in replay_lines(found, time.perf_counter() - began_s):
        echo(line)
    if found.differences:
        raise UserError(
            f"{folder}: the guard of this version differs from the record in "
            f"{found.differing_ticks} of {found.ticks} ticks"
        )


def replay_lines(found: Replay, took_s: float) -> list[str]:
    """Return what is shown, line by line."""
    lines = [
        f"Replayed: {found.ticks} ticks, {found.duration_s:.1f} s in {took_s:.1f} s, "
        f"{found.duration_s / max(took_s, 1e-9):.0f} times real time."
    ]
    if found.left_out:
        lines.append(f"Not replayed: {found.left_out}.")
    lines.append(f"The guard stopped or held for: {_causes(found.found) or 'nothing'}.")
    if found.reported:
        lines.append(f"Reported by loop or devices, not replayed: {_causes(found.reported)}.")
    lines += [f"Did not run: {what}." for what in found.not_run]
    same = "Commands: the same to the bit"
    if found.rounded_ticks:
        by_deg_s = deg_from_rad(found.rounded_rad_s)
        same += (
            f", but for {found.rounded_ticks} that the drive rounded, repeated or did not carry "
            f"out, by at most {by_deg_s:.2g} deg/s"
        )
    if found.differences:
        lines += ["First differences:", *(f"  {each}" for each in found.differences)]
    else:
        lines += [f"{same}.", "Same causes and limits at the same ticks as in the record."]
    return lines


def _causes(named: Sequence[NamedCause]) -> str:
    return ", ".join(f"{each.cause.name} at {each.time_s:.3f} s" for each in named)
