"""Everything about a file in one screen, before anything is fitted."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import METHODS
from rigidimeter.analysis.reading.channels.choice import MOTION
from rigidimeter.analysis.reading.channels.column_facts import ColumnFacts, column_facts
from rigidimeter.analysis.reading.channels.lever_arm import lever_arm
from rigidimeter.analysis.reading.channels.proposal import Proposal, propose
from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD, names_epochs
from rigidimeter.analysis.reading.channels.readings import look_text
from rigidimeter.analysis.reading.formats.columns import numbers
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import CALIBRATION, Table
from rigidimeter.core.errors import UserError

EPOCH_LENGTH_S = 20.0
"""Proposed where a recording without epochs is longer than two of them."""


@dataclass(frozen=True)
class Inspection:
    """What there is to say of a table.

    Parameters
    ----------
    table : Table
    facts : tuple of ColumnFacts
    time_s : array, shape (n,), or None
        Of the rows, where it is known.
    proposal : Proposal
    """

    table: Table
    facts: tuple[ColumnFacts, ...]
    time_s: NDArray[np.float64] | None
    proposal: Proposal

    @property
    def options(self) -> ReadOptions:
        """What reads the file, as far as that is known."""
        return self.proposal.options


def inspect_table(table: Table, options: ReadOptions) -> Inspection:
    """Look at a table, with the options that are given already."""
    proposal = propose(table, options)
    time_s = _time(table, proposal)
    return Inspection(table, tuple(column_facts(table, time_s)), time_s, proposal)


def _time(table: Table, proposal: Proposal) -> NDArray[np.float64] | None:
    taken = proposal.choice.taken.get("time_s")
    if taken is None or taken.to_si is None:
        return None
    try:
        return taken.to_si(numbers(table, "time_s", taken.column, []))
    except UserError:
        return None


def column_rows(found: Inspection) -> list[tuple[str, ...]]:
    """Return a heading and a row for each column."""
    roles = {taken.column: taken for taken in found.proposal.choice.taken.values()}
    heading = ("column", "unit", "samples/s", "jitter", "gaps", "missing", "range", "read as")
    rows: list[tuple[str, ...]] = [heading]
    for one in found.facts:
        taken = roles.get(one.name)
        spoken = "" if taken is None else BY_STANDARD.get(taken.standard, taken).standard
        if taken is None and one.kind:
            spoken = f"({one.kind.replace('_', ' ')})"
        unit = taken.unit if taken is not None and taken.unit else one.unit
        rows.append(
            (
                one.name,
                unit or "?",
                _number(one.rate_hz, ".5g"),
                _number(one.jitter_percent, ".1f", " %"),
                str(one.n_gaps) if math.isfinite(one.rate_hz) else "",
                str(one.n_missing),
                one.text or f"{one.lowest:.4g} to {one.highest:.4g}",
                spoken,
            )
        )
    return rows


def remarks(found: Inspection) -> list[str]:
    """Return what the numbers look like as they are read, and what each method lacks."""
    lines = []
    seen = found.proposal.seen
    if seen is not None:
        rough = "" if seen.fit is None else f", R² {seen.fit.r_squared:.2f} (rough, 0.3 to 15 Hz)"
        lines.append(f"so read: {look_text(seen)}{rough}")
    have = set(found.proposal.choice.taken)
    able, unable = [], []
    for method in METHODS:
        lacking = [name for name in method.needs if name not in have]
        if not lacking and have & set(MOTION) and "torque_nm" in have:
            able.append(method.name)
        else:
            lacking = lacking or ["torque and motion"]
            unable.append(f"{method.name} lacks {' and '.join(lacking)}")
    lines.append(f"methods: {', '.join(able) or 'none'}" + "".join(f"; {text}" for text in unable))
    lines += found.proposal.notices
    arm = lever_arm(found.table.scalars)
    if arm and arm in found.options.scales.values():
        lines.append(f"the file states a lever arm of {arm}: the torque is the force times it")
    elif stated := found.table.scalars.get(CALIBRATION):
        lines.append(f"the file says {str(stated)[:80]!r}: if that is a calibration, say --scale")
    return [*lines, *(f"decided by the numbers: {text}" for text in found.proposal.reasons)]


def option_words(found: Inspection) -> list[str]:
    """Return the options of the command line that read the table."""
    options = found.options
    words: list[str] = []
    pairs = (
        ("column", options.columns), ("unit", options.units), ("scale", options.scales),
        ("offset", options.offsets),
    )  # fmt: skip
    for name, given in pairs:
        for key, text in given.items():
            words += [f"--{name}", f"{key}={text}"]
    if options.skip_rows:
        words += ["--skip-rows", str(options.skip_rows)]
    if options.table:
        words += ["--table", options.table]
    if options.names:
        words += ["--names", ",".join(options.names)]
    if options.missing:
        words += ["--missing", options.missing]
    if options.rate_hz is not None:
        words += ["--rate-hz", f"{options.rate_hz:g}"]
    if options.reaction:
        words.append("--reaction")
    if options.task is not None:
        words += ["--task", options.task]
    length_s = options.epoch_length_s
    seen = found.proposal.seen
    # Where columns are named as trials are, a length would cut across these.
    if length_s is None and seen is not None and not any(map(names_epochs, found.table.columns)):
        has_epochs = "epoch" in found.proposal.choice.taken
        long = seen.duration_s >= 2 * EPOCH_LENGTH_S
        length_s = EPOCH_LENGTH_S if long and not has_epochs else None
    return words if length_s is None else [*words, "--epoch-length-s", f"{length_s:g}"]


def command_for(paths: Sequence[Path], words: Sequence[str]) -> str:
    """Return the command that estimates files."""
    return shlex.join(["rigidimeter", "estimate", *map(str, paths), *words])


def _number(value: float, form: str, unit: str = "") -> str:
    return "" if math.isnan(value) else f"{value:{form}}{unit}"
