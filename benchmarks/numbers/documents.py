"""From the documents that the commands write to numbers by name, one function a document.

If a document changes its structure, only its function here changes; the names stay. Rows are sorted
by what they are about, so their order does not matter.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pyarrow as pa

__all__ = [
    "BRIEF",
    "Numbers",
    "Value",
    "comparisons_numbers",
    "design_numbers",
    "estimates_numbers",
    "ledger_numbers",
    "models_numbers",
    "ratings_numbers",
    "session_numbers",
    "study_numbers",
    "table_comparison_numbers",
    "tables_numbers",
]

Value: TypeAlias = float | str | None
Numbers: TypeAlias = dict[str, Value | list[Value]]

Row: TypeAlias = Mapping[str, Any]

PARAMETERS = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
FIT = (
    "outcome",
    *(f"{name}{end}" for name in PARAMETERS for end in ("", "_se", "_low", "_high", "_bound")),
    "r_squared",
    "vaf_percent",
    "condition_number",
    "residual_sd_nm",
    "n_samples",
    "band_hz.0",
    "band_hz.1",
)
BRIEF = ("outcome", *(f"{name}{end}" for name in PARAMETERS for end in ("", "_se")), "r_squared")
"""For a large study."""

SCORE = ("outcome", "impulse_nm_s", "work_j", "frequency_hz", "n_cycles")
TEST = (
    *(f"{which}.{key}" for which in ("of_reference", "of_other")
      for key in ("n", "median", "q1", "q3")),
    *("z", "p", "r", "shift", "shift_low", "shift_high", "shift_bounded", "confidence"),
    *("z_uncorrected", "p_uncorrected", "u"),
)  # fmt: skip
EFFECTS = (
    *("r_low", "r_high", "rank_biserial", "rank_biserial_low", "rank_biserial_high"),
    *("p_holm",),
)
RATING = "rating"
"""The examiners' ratings among the measures of a study."""

_TESTED = ("shift", "shift_low", "shift_high", "confidence", "u", "z", "p", "r")
RESULTS = (
    *(f"{key}_{side}" for side in ("reference", "other")
      for key in ("n", "excluded", "median", "q1", "q3")),
    *(*_TESTED, "z_uncorrected", "p_uncorrected"),
)  # fmt: skip
SIZES = ("n_x", "n_y", *_TESTED, *EFFECTS)
BY_DAYS = (
    *("estimate", "low", "high", "p", "df", "days_reference", "days_other", "p_days", "day_share"),
    *("confidence", "p_holm"),
)
"""Columns of `comparisons.csv`, which is kept as three tables."""
RENAMED = {"days": "day_medians"}
"""Other tables that are kept by another name."""
CONTRAST = (
    *("estimate", "se", "f", "df_residual", "p_residual", "df_satterthwaite", "p_satterthwaite"),
    *("se_kenward_roger", "f_kenward_roger", "df_kenward_roger", "p_kenward_roger"),
)


def session_numbers(folder: Path) -> Numbers:
    """Return root mean square, least and largest of each recorded channel, and the true joints.

    The first to differ if the simulated rig, the loop or the guard has changed.
    """
    with pa.OSFile(str(folder / "samples.arrows")) as file:
        samples = pa.ipc.open_stream(file).read_all()
    found: Numbers = {"n_samples": float(samples.num_rows)}
    for name in samples.column_names:
        values = np.asarray(samples[name], dtype=float)
        values = values[np.isfinite(values)]
        found[f"channels/{name}"] = (
            [float(np.sqrt(np.mean(values**2))), float(np.min(values)), float(np.max(values))]
            if values.size
            else [None]
        )
    lines = (folder / "events.jsonl").read_text(encoding="utf-8").splitlines()
    events = [json.loads(line) for line in lines]
    started = [_flat(event) for event in events if event["event"] == "epoch_started"]
    ended = [_flat(event) for event in events if event["event"] == "epoch_ended"]
    joint = [f"true_joint.{name}" for name in PARAMETERS]
    found |= _columns("started", started, ("epoch",), ("condition", "time_s", *joint))
    return found | _columns("ended", ended, ("epoch",), ("time_s", "outcome", "limited_ticks"))


def estimates_numbers(document: Row, keys: Sequence[str] = FIT) -> Numbers:
    """Return every fit, score, delay and finding of `estimate --json`."""
    whose = ("source", "epoch", "condition")
    fits = [_of_epoch(row) for row in document["epochs"]]
    fixed = [_of_epoch(row) for row in document["fixed_inertia"]["epochs"]]
    found: Numbers = {
        "method": document["method"],
        "inertia_kg_m2": document["fixed_inertia"]["inertia_kg_m2"],
    }
    found |= _columns("fits", fits, whose, keys)
    found |= _columns("fixed", fixed, whose, [key for key in keys if PARAMETERS[0] not in key])
    found |= _columns("scores", [_of_epoch(row) for row in document["scores"]], whose, SCORE)
    delays = [_of_epoch(row) for row in document["delays"]]
    found |= _columns("delays", delays, ("source",), ("delay_s", "delay_s_se", "corrected"))
    if document["pooled"] is not None:
        pooled = {"(all)": document["pooled"], **document["pooled"].get("conditions", {})}
        rows = [{**_of_epoch(row), "of": name} for name, row in pooled.items()]
        found |= _columns("pooled", rows, ("of",), FIT)
    if keys is BRIEF:
        return found
    findings = [
        {"fit": " ".join(str(row[key]) for key in whose), **finding}
        for row in fits
        for finding in row["findings"]
    ]
    return found | _columns("findings", findings, ("fit", "name"), ("level", "value", "threshold"))


def comparisons_numbers(document: Row) -> Numbers:
    """Return the tests by epochs of `compare RECORDINGS --json`."""
    rows = [_test(row) for row in document["comparisons"] if row["measure"] != RATING]
    excluded = ("of_reference.excluded", "of_other.excluded")
    return {
        "method": document["method"],
        **_columns("epochs", rows, ("measure",), (*TEST, *excluded)),
    }


def table_comparison_numbers(document: Row) -> Numbers:
    """Return the tests and effect sizes of `compare TABLE --value COLUMN --json`."""
    rows = [_test(row) for row in document["comparisons"]]
    return {
        **_columns("columns", rows, ("measure",), (*TEST, *EFFECTS)),
        **_differences(document["effect_differences"]),
    }


def study_numbers(document: Row) -> Numbers:
    """Return every conclusion of `compare STUDY --json`."""
    rows = document["comparisons"]
    tested = [row for row in rows if row["p"] is not None]
    by_days = [
        {**row["days"], "measure": row["measure"]}
        for row in rows
        if row["days"] is not None and row["measure"] != RATING
    ]
    return {
        **comparisons_numbers(document),
        "inertia_kg_m2": document["inertia_kg_m2"],
        "sessions": float(len(document["sessions"])),
        "exclusions": float(len(document["exclusions"])),
        **_columns(
            "days",
            document["days"],
            ("measure", "subject", "day", "condition"),
            ("n", "median", "q1", "q3"),
        ),
        **_columns(
            "day_tests",
            by_days,
            ("measure",),
            ("estimate", "low", "high", "p", "df", "days_reference", "days_other", "p_days",
             "day_share"),
        ),
        **_columns("effects", tested, ("measure",), ("p", "r", *EFFECTS)),
        **_differences(document["effect_differences"]),
        **_columns(
            "sensitivity",
            document["sensitivity"],
            ("measure", "method", "inertia"),
            ("n_reference", "n_other", "shift", "shift_low", "shift_high", "p", "r", "p_day"),
        ),
        **_study_ratings(document["ratings"]),
    }  # fmt: skip


def ratings_numbers(document: Row) -> Numbers:
    """Return the mixed model of `ratings --json`."""
    found = _mixed_model(document)
    contrasts = document["contrasts"]
    rows = [contrasts] if isinstance(contrasts, Mapping) else contrasts
    keys = (*CONTRAST, "p_residual_holm", "p_satterthwaite_holm")
    found |= _columns("contrasts", rows, ("first", "second"), keys)
    joint = _flat(document["joint"] or {})
    found |= {f"joint/{name}": _value(value) for name, value in joint.items()}
    return found | {"corrected": [_value(value) for value in document["corrected"]]}


def models_numbers(document: Row) -> Numbers:
    """Return each fitted model and its parameters of `model --json`, and which is recommended."""
    epochs, models, parameters = [], [], []
    for row in map(_of_epoch, document["epochs"]):
        epoch = " ".join(str(row[key]) for key in ("source", "epoch", "condition"))
        best = "+".join(row.get("recommended") or [])
        epochs.append({"epoch": epoch, "outcome": row["outcome"], "recommended": best})
        for one in row["models"]:
            name = "+".join(one["terms"])
            models.append({"epoch": epoch, "terms": name, **one, "fitted": "parameters" in one})
            models[-1]["terms"] = name
            parameters += [
                {"epoch": epoch, "terms": name, "parameter": f"{p['term']} {p['name']}".strip()} | p
                for p in one.get("parameters", ())
            ]
    about = ("epoch", "terms")
    keys = (
        *("fitted", "held_out_vaf_percent", "n_parameters", "vaf_percent", "aic", "bic"),
        *("independent_samples", "condition_number", "ljung_box_p", "input_correlation", "input_p"),
    )
    return {
        **_columns("epochs", epochs, ("epoch",), ("outcome", "recommended")),
        **_columns("models", models, about, keys),
        **_columns(
            "parameters", parameters, (*about, "parameter"), ("value", "standard_error")
        ),
    }  # fmt: skip


def ledger_numbers(rows: Sequence[Row]) -> Numbers:
    """Return verdict and checks of each row of `reproduce`."""
    checks = [
        {"id": row["id"], "number": f"{number:02d}", **check}
        for row in rows
        for number, check in enumerate(row["checks"])
    ]
    return {
        **_columns("rows", rows, ("id",), ("verdict",)),
        **_columns(
            "checks", checks, ("id", "number"), ("paper", "ours", "low", "high", "within")
        ),
    }  # fmt: skip


def design_numbers(document: Row) -> Numbers:
    """Return every number of `design --json` under its path; what was searched as columns."""
    searched = document.get("optimised") or []
    rest = {name: value for name, value in document.items() if name != "optimised"}
    numbers: Numbers = {
        name: _value(value)
        for name, value in _flat(rest).items()
        if not isinstance(value, str) and value is not None
    }
    about = ("register_bits", "clock_hz", "amplitude_nm")
    keys = ("cost_percent", "angle_sd_rad", "peak_angle_rad", "covered")
    return numbers | (_columns("optimised", searched, about, keys) if searched else {})


def tables_numbers(folder: Path, left_out: Iterable[str] = ()) -> Numbers:
    """Return every column of numbers in the tables of a report."""
    found: Numbers = {}
    for path in sorted(folder.glob("*.csv")):
        if path.stem in left_out:
            continue
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        for table, part in _tables(path.stem, rows).items():
            for name in part[0] if part else ():
                values = [_read(row[name]) for row in part]
                if {type(value) for value in values} - {type(None)} == {float}:
                    found[f"{table}/{name}"] = values
    return found


def _tables(name: str, rows: Sequence[Row]) -> dict[str, Sequence[Row]]:
    """Return a table of a report under the names that its numbers are kept by."""
    if name == "comparisons":
        by_epochs = [row for row in rows if row["measure"] != RATING]
        return {
            "results": [{key: row[key] for key in RESULTS} for row in by_epochs],
            "effects": [{key: row[key] for key in SIZES} for row in rows],
            "day_tests": [
                {key: row[key if key.startswith("days_") else f"days_{key}"] for key in BY_DAYS}
                for row in rows
            ],
        }
    if name == "effect_differences":
        keys = {"estimate": "difference"}
        return {name: [{keys.get(key, key): cell for key, cell in row.items()} for row in rows]}
    if name == "summaries":
        return {name: [row for row in rows if row["measure"] != RATING]}
    return {RENAMED.get(name, name): rows}


def _test(row: Row) -> dict[str, Any]:
    """Return a comparison with the summaries of its groups under fixed names."""
    groups = row["groups"]
    sides = {f"of_{side}": groups.get(row[side]) for side in ("reference", "other")}
    return {**row, **_flat(sides)}


def _differences(rows: Sequence[Row]) -> Numbers:
    return _columns(
        "effect_differences",
        rows,
        ("first", "second"),
        ("estimate", "low", "high", "p", "paired"),
    )


def _study_ratings(found: Row | None) -> Numbers:
    if found is None:
        return {"ratings": None}
    numbers = _mixed_model(found)
    for which in ("contrast", "contrast_days"):
        contrast = found[which] or {}
        numbers |= {f"{which}/{key}": _value(contrast.get(key)) for key in CONTRAST}
    numbers["corrected"] = [_value(row["corrected"]) for row in found["rows"]]
    return {f"ratings/{name}": value for name, value in numbers.items()}


def _mixed_model(found: Row) -> Numbers:
    """Return what `ratings` and a study both say of the mixed model."""
    offsets = found.get("offsets_by") or found["offsets"]
    parts = {name: found[name] for name in ("means", "means_se", "variances")}
    flat = {**_flat(parts), **_flat({"offsets": offsets})}
    numbers: Numbers = {name.replace(".", "/"): _value(value) for name, value in flat.items()}
    for name in ("n", "variance_residual", "reml_deviance"):
        numbers[name] = _value(found[name])
    return numbers


def _of_epoch(row: Row) -> dict[str, Any]:
    """Return a row flat, its source without the folder that it lies in."""
    sources = [Path(part).name for part in row["source"].split(", ")] if "source" in row else []
    findings = {"findings": row["findings"]} if "findings" in row else {}
    models = {key: row[key] for key in ("models", "recommended") if key in row}
    return {**_flat(row), **findings, **models, "source": ", ".join(sources)}


def _columns(
    prefix: str, rows: Sequence[Row], about: Sequence[str], keys: Iterable[str]
) -> Numbers:
    """Return rows as columns, sorted; the column `row` says what each is about."""
    labelled = sorted(
        ((" ".join(str(row.get(key, "")) for key in about), row) for row in rows),
        key=lambda pair: pair[0],
    )
    found: Numbers = {f"{prefix}/row": [label for label, _ in labelled]}
    return found | {
        f"{prefix}/{key}": [_value(row.get(key)) for _, row in labelled]
        for key in (keys if rows else ())
    }


def _flat(value: Any, path: str = "") -> dict[str, Any]:
    """Return the leaves of a document by path."""
    if isinstance(value, Mapping):
        pairs = [(str(name), each) for name, each in value.items()]
    elif isinstance(value, (list, tuple)):
        pairs = [(str(index), each) for index, each in enumerate(value)]
    else:
        return {path: value}
    found: dict[str, Any] = {}
    for name, each in pairs:
        found |= _flat(each, f"{path}.{name}" if path else name)
    return found


def _value(value: Any) -> Value:
    """Return a number as float, a text as it is, and null where there is neither."""
    if value is None or isinstance(value, str):
        return value
    number = float(value)
    return number if math.isfinite(number) else None


def _read(cell: str) -> Value:
    if cell == "":
        return None
    try:
        return _value(float(cell))
    except ValueError:
        return cell
