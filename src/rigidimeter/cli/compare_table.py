"""Compare two groups of any table: tests, effect sizes, and which measure parts them better."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.errors import UserError

if TYPE_CHECKING:
    import numpy as np

    from rigidimeter.recording.formats import TextTable
    from rigidimeter.statistics import EffectDifference, Effects, Summary

__all__ = ["Measured", "TableComparison", "compare_table"]

FEWEST = 3
"""Below this many values in a group there is no test, as in `study`."""
_ALPHA = 0.05


@dataclass(frozen=True)
class Measured:
    """One column in both groups: values, their units, and what came of them."""

    name: str
    values: Mapping[str, tuple[float, ...]]
    units: Mapping[str, tuple[str, ...]]
    summaries: Mapping[str, Summary]
    effects: Effects | None
    remark: str


@dataclass(frozen=True)
class TableComparison:
    """All columns, what sets them apart, and what is to be said."""

    source: str
    by: str
    names: tuple[str, str]
    measures: tuple[Measured, ...]
    p_holm: tuple[float, ...]
    differences: tuple[tuple[str, str, EffectDifference, float], ...]
    notices: tuple[str, ...]
    seed: int
    resamples: int


def compare_table(
    path: Path,
    values: Sequence[str],
    by: str,
    pair: tuple[str | None, str | None],
    session: str | None,
    seed: int,
    resamples: int,
) -> TableComparison:
    """Compare two groups of a table in one column or several.

    Parameters
    ----------
    path : Path
    values : sequence of str
        Columns of numbers.
    by : str
        The column that names the group.
    pair : tuple of str or None
        Reference and other group; the first two where not given.
    session : str or None
        A column whose labels are resampled as units; else each row is one.
    seed, resamples : int
        Of the bootstrap.

    Raises
    ------
    UserError
        If the table, a column or a group is not there, or a cell is no number.
    """
    import numpy as np

    from rigidimeter.recording.formats import read_text_table
    from rigidimeter.statistics import holm

    table = read_text_table(path)
    labels = table.column(by, "--by")
    for name in values:
        table.column(name, "--value")
    units = table.column(session, "--session") if session is not None else None
    names = _pair(table.source, by, labels, pair)
    kept, notices = _kept(table, labels, names, by)
    measures, rng = [], np.random.default_rng(seed)
    for name in dict.fromkeys(values):
        measured, said = _measured(table, name, labels, units, names, kept, rng, resamples)
        measures.append(measured)
        notices += said
    adjusted = holm([m.effects.test.p if m.effects else math.nan for m in measures])
    differences = _differences(measures, names, rng, resamples)
    of_sizes = holm([found.p for _, _, found in differences])
    return TableComparison(
        source=table.source,
        by=by,
        names=names,
        measures=tuple(measures),
        p_holm=adjusted,
        differences=tuple((*d, p) for d, p in zip(differences, of_sizes, strict=True)),
        notices=tuple(notices),
        seed=seed,
        resamples=resamples,
    )


def _pair(
    source: str, by: str, labels: Sequence[str], wanted: tuple[str | None, str | None]
) -> tuple[str, str]:
    known = sorted((name for name in dict.fromkeys(labels) if name), key=lambda n: n != "OFF")
    listed = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")
    for option, name in zip(("--reference", "--other"), wanted, strict=True):
        if name is not None and name not in known:
            raise UserError(f"{option} {name}: column {by} of {source} has only {listed}")
    if wanted[0] is not None and wanted[0] == wanted[1]:
        raise UserError(f"--reference and --other are both {wanted[0]}; name two groups")
    if len(known) < 2:
        raise UserError(
            f"{source}: a comparison needs two groups, but column {by} has "
            f"{f'only {listed}' if known else 'none'}; name another column with --by"
        )
    if len(known) > 2 and None in wanted:
        raise UserError(
            f"{source}: column {by} has {len(known)} groups ({listed}); choose two with "
            "--reference and --other"
        )
    first, second = wanted
    first = first or next(name for name in known if name != second)
    return first, second or next(name for name in known if name != first)


def _kept(
    table: TextTable, labels: Sequence[str], names: Sequence[str], by: str
) -> tuple[list[int], list[str]]:
    """Return the rows of both groups, without those that an analysis has excluded."""
    rows = [k for k, label in enumerate(labels) if label in names]
    notices = []
    nameless = [table.lines[k] for k, label in enumerate(labels) if not label]
    if nameless:
        notices.append(f"{table.source}: no {by} in {_lines_named(nameless)}; left out")
    outcomes = table.columns.get("outcome")
    if outcomes is not None and set(outcomes) <= {"included", "excluded", "failed"}:
        out = [table.lines[k] for k in rows if outcomes[k] != "included"]
        rows = [k for k in rows if outcomes[k] == "included"]
        if out:
            notices.append(
                f"{table.source}: outcome is excluded or failed in {_lines_named(out)}; left out"
            )
    return rows, notices


def _measured(
    table: TextTable,
    name: str,
    labels: Sequence[str],
    units: Sequence[str] | None,
    names: tuple[str, str],
    kept: Sequence[int],
    rng: np.random.Generator,
    resamples: int,
) -> tuple[Measured, list[str]]:
    from rigidimeter.statistics import effect_sizes, summarise, two_groups

    values: dict[str, list[float]] = {group: [] for group in names}
    own: dict[str, list[str]] = {group: [] for group in names}
    missing = []
    for row in kept:
        value = table.number(name, row)
        unit = units[row] if units is not None else f"line {table.lines[row]}"
        if value is None or not unit:
            missing.append(table.lines[row])
            continue
        values[labels[row]].append(value)
        own[labels[row]].append(unit)
    notices = []
    if missing:
        notices.append(f"{table.source}: no {name} in {_lines_named(missing)}; left out")
    sizes = [len(values[group]) for group in names]
    if min(sizes) == 0:
        raise UserError(
            f"{table.source}: {name} has no value in {names[sizes.index(0)]}, so there is nothing "
            "to compare"
        )
    first, second = names
    effects, remark = None, ""
    counts = " and ".join(f"{n} in {group}" for n, group in zip(sizes, names, strict=True))
    if min(sizes) < FEWEST:
        remark = (
            f"a test needs {FEWEST} values in each group; there are {counts}. Medians and "
            "quartiles are given without one"
        )
    else:
        groups = two_groups(values[first], values[second], own[first], own[second])
        effects = effect_sizes(groups, rng, resamples=resamples)
        least = 2 / math.comb(sum(sizes), sizes[0])
        if least > _ALPHA:
            notices.append(
                f"{table.source}: {name} has {counts}; even groups that do not overlap have an "
                f"exact p of {least:.2g}, so this test cannot show a difference"
            )
    if remark:
        notices.append(f"{table.source}: {name}: {remark}")
    n_units = min(len(set(own[group])) for group in names)
    if units is not None and effects is not None and n_units < 10:
        notices.append(
            f"{table.source}: {name} has {n_units} sessions in one group; so few make a bootstrap "
            "interval too narrow"
        )
    summaries = {group: summarise(values[group]) for group in names}
    return Measured(
        name,
        {group: tuple(values[group]) for group in names},
        {group: tuple(own[group]) for group in names},
        summaries,
        effects,
        remark,
    ), notices


def _differences(
    measures: Sequence[Measured],
    names: tuple[str, str],
    rng: np.random.Generator,
    resamples: int,
) -> list[tuple[str, str, EffectDifference]]:
    """Compare the effect sizes of every two columns, paired where they share units."""
    from rigidimeter.statistics import compare_effects, two_groups

    found = []
    x, y = names
    tested = [m for m in measures if m.effects is not None]
    for first, second in itertools.combinations(tested, 2):
        one, two = (
            two_groups(m.values[x], m.values[y], m.units[x], m.units[y]) for m in (first, second)
        )
        paired = not any(set(first.units[g]).isdisjoint(second.units[g]) for g in names)
        difference = compare_effects(one, two, rng, paired=paired, resamples=resamples)
        found.append((first.name, second.name, difference))
    return found


def _lines_named(lines: Sequence[int]) -> str:
    shown = ", ".join(map(str, lines[:5]))
    more = f" and {len(lines) - 5} more" if len(lines) > 5 else ""
    return f"line{'' if len(lines) == 1 else 's'} {shown}{more}"
