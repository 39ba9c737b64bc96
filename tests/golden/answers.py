"""From the documents that a command writes to the rows of the table."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.golden.table import Row

KEPT = re.compile(
    r"(inertia|damping|stiffness)_\w+|impulse_nm_s|work_j|n_cycles|delay_s(_se)?|corrected"
    r"|outcome|level|value|verdict|tested_by|chosen"
    r"|p|p_\w+|\w+_p|estimate|se|low|high|df|df_\w+|f|f_\w+|n|n_\w+|sd|excluded"
    r"|z|r|r_low|r_high|u|shift|shift_low|shift_high|rank_biserial\w*|median|days_\w+|day_share"
    r"|percent|percent_low|percent_high|difference\w*|measured_\w+|days_to_decide"
    r"|rho\w*|reml_deviance|variance\w*|means?|means_se"
    r"|held_out_vaf_percent|vaf_percent|recommended|aic|method|epochs|sound|doubted|doubt"
    r"|covered|half_power_hz|bandwidth_hz|gain_margin_db|delay_margin_s|angle_sd_rad|cost_percent"
    r"|total_s|within|ours|subjects_needed|day_sd|power|corrected|(?!n_samples)n_samples"
)
"""Keys whose value is an answer; names, texts and what else describes the input are none."""

LABELS = (
    *("name", "parameter", "measure", "first", "second", "subject", "day", "condition", "source"),
    *("epoch", "terms", "term", "method", "inertia", "low_hz", "high_hz", "part", "code"),
)
"""What an item of a list is called by, as far as it has them."""

FINDING = ("level", "value")
"""What of a finding is an answer."""

NOT_KEPT = re.compile(r"\w+_(bound|change|change_se)")
SKIPPED = ("provenance", "settings", "band_hz", "rows", "sessions", "corners", "optimised")
"""Parts that repeat the input, or what stands elsewhere."""


def rows_of(document: Mapping[str, Any], left_out: Sequence[str] = ()) -> dict[str, Row]:
    """Return the answers of a document by where they stand in it."""
    found: dict[str, Row] = {}
    for what, row in _walk("", document, (*SKIPPED, *left_out)):
        found[what if what not in found else f"{what} again"] = row
    return found


def _walk(path: str, value: Any, skipped: Sequence[str]) -> Iterator[tuple[str, Row]]:
    if isinstance(value, Mapping):
        row = {key: _plain(one) for key, one in value.items() if _is_answer(key, one)}
        if row:
            yield path or ".", row
        for key, one in value.items():
            if key not in skipped and isinstance(one, (Mapping, list)):
                yield from _walk(f"{path}/{key}" if path else key, one, skipped)
    elif isinstance(value, list):
        for number, one in enumerate(value):
            if isinstance(one, Mapping) and "headline" in one:
                yield f"{path} {one['name']}", {k: one[k] for k in FINDING if one[k] is not None}
            elif isinstance(one, Mapping):
                yield from _walk(f"{path} {_label(one) or number}", one, skipped)


def _is_answer(key: str, value: Any) -> bool:
    if key == "recommended" or (isinstance(value, (bool, int, float, str))):
        return KEPT.fullmatch(key) is not None and not NOT_KEPT.fullmatch(key)
    return False


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return "+".join(map(str, value))
    return int(value) if isinstance(value, bool) else value


def _label(item: Mapping[str, Any]) -> str:
    parts = []
    for key in LABELS:
        one = item.get(key)
        if isinstance(one, list):
            parts.append("+".join(map(str, one)))
        elif isinstance(one, float):
            parts.append(f"{one:.3g}")
        elif one not in (None, ""):
            parts.append(Path(str(one)).name)
    return " ".join(parts)


def table_rows(rows: Sequence[Mapping[str, str]]) -> dict[str, Row]:
    """Return the answers of a table of texts, a row for each of its rows."""
    found: dict[str, Row] = {}
    for row in rows:
        numbers = {key: _read(cell) for key, cell in row.items() if KEPT.fullmatch(key) and cell}
        found[_label(row)] = numbers
    return found


def _read(cell: str) -> Any:
    try:
        return float(cell)
    except ValueError:
        return cell
