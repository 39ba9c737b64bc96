"""A comparison of columns of a table as JSON and as text."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidimeter.cli.compare_table import Measured, TableComparison

__all__ = ["COMPARISON_SCHEMA", "comparison_document", "comparison_lines"]

COMPARISON_SCHEMA = "rigidimeter.comparison/1"
TEST = "Wilcoxon rank-sum, two-sided, asymptotic, tie and continuity corrected"


def comparison_document(found: TableComparison) -> dict[str, Any]:
    """Return the comparison as plain values: the first column on top, all under `comparisons`."""
    rows = [_row(found, m, p) for m, p in zip(found.measures, found.p_holm, strict=True)]
    return {
        "schema": COMPARISON_SCHEMA,
        "source": found.source,
        "by": found.by,
        **rows[0],
        "comparisons": rows,
        "effect_differences": [
            {"first": first, "second": second, "p_holm": _null(p)}
            | {key: _null(value) for key, value in asdict(difference).items()}
            for first, second, difference, p in found.differences
        ],
        "seed": found.seed,
        "resamples": found.resamples,
        "notices": list(found.notices),
    }


def _row(found: TableComparison, measured: Measured, p_holm: float) -> dict[str, Any]:
    row: dict[str, Any] = {
        "value": measured.name,
        "reference": found.names[0],
        "other": found.names[1],
        "convention": f"{found.names[0]} minus {found.names[1]}",
        "groups": {name: asdict(measured.summaries[name]) for name in found.names},
        "n": sum(summary.n for summary in measured.summaries.values()),
        "test": TEST,
    }
    sizes = ("r", "r_low", "r_high", "rank_biserial", "rank_biserial_low", "rank_biserial_high")
    tests = ("z", "p", "shift", "shift_low", "shift_high", "shift_bounded", "u", "confidence",
             "z_uncorrected", "p_uncorrected")  # fmt: skip
    effects = measured.effects
    row |= {key: getattr(effects.test, key) if effects else None for key in tests}
    row |= {key: getattr(effects, key) if effects else None for key in sizes}
    return row | {
        "interval_method": effects.method if effects else None,
        "p_holm": _null(p_holm),
        "remark": measured.remark,
    }


def _null(value: Any) -> Any:
    return None if isinstance(value, float) and math.isnan(value) else value


def comparison_lines(found: TableComparison) -> list[str]:
    """Return the comparison as lines for a terminal."""
    reference, other = found.names
    several = len(found.measures) > 1
    lines = [f"{found.source} by {found.by}: {reference} minus {other}", f"{TEST}", ""]
    for measured, p_holm in zip(found.measures, found.p_holm, strict=True):
        lines.append(measured.name)
        for name in found.names:
            s = measured.summaries[name]
            lines.append(
                f"  {name:>10}: n {s.n:3d}, median {s.median:.4g} [{s.q1:.4g} to {s.q3:.4g}]"
            )
        if measured.effects is None:
            lines.append(f"  no test: {measured.remark}")
            continue
        e, t = measured.effects, measured.effects.test
        adjusted = f", p by Holm {p_holm:.2g}" if several else ""
        wide = "" if t.shift_bounded else " (too few values for 95 %)"
        lines += [
            f"  shift {t.shift:.4g} [{t.shift_low:.4g} to {t.shift_high:.4g}]{wide}, "
            f"z {t.z:.3f}, p {t.p:.2g}{adjusted}",
            f"  r {e.r:.3f} [{e.r_low:.3f} to {e.r_high:.3f}], rank-biserial {e.rank_biserial:.3f} "
            f"[{e.rank_biserial_low:.3f} to {e.rank_biserial_high:.3f}] ({e.method})",
        ]
    if found.differences:
        lines += ["", "Which parts the groups better (difference of rank-biserial correlations):"]
    for first, second, d, p_holm in found.differences:
        how = "paired" if d.paired else "independent"
        if math.isnan(d.p):
            lines.append(f"  {first} − {second}: {d.estimate:.3f}, both part them fully ({how})")
        else:
            lines.append(
                f"  {first} − {second}: {d.estimate:.3f} [{d.low:.3f} to {d.high:.3f}], "
                f"p {d.p:.2g}, by Holm {p_holm:.2g} ({how})"
            )
    return lines
