"""What is predicted of a session, in sentences that say what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import NormalDist
from typing import Any

from rigidimeter.core.settings import MarginsSettings
from rigidimeter.core.study_files import PrimaryTable

SYMBOLS = {"inertia_kg_m2": "J", "damping_nm_s_rad": "B", "stiffness_nm_rad": "K"}
Z95 = NormalDist().inv_cdf(0.975)
"""Standard errors on either side in a 95 % interval."""


def prediction_lines(document: Mapping[str, Any], wanted: MarginsSettings) -> list[str]:
    """Return the sentences on stability, precision, days needed and limits.

    Parameters
    ----------
    document : mapping
        A `rigidimeter.design/3`.
    wanted : MarginsSettings
        The margins that are required.
    """
    return [
        _stability(document["stability"], wanted),
        *_precision(document["precision"]),
        *(one["sentence"] for one in document["detection"]),
        *(f"! {text}." for text in (*document["warnings"], *document["remarks"])),
    ]


def _stability(found: Mapping[str, Any], wanted: MarginsSettings) -> str:
    asked = f"{wanted.gain_margin_db:g} dB and {wanted.phase_margin_deg:g} deg are required"
    unstable = [name for name, margins in found["conditions"].items() if not margins["stable"]]
    if unstable:
        return (
            f"✗ Unstable with {', '.join(unstable)}: raise the controller's inertia or damping, or "
            f"shorten the delays ({asked})."
        )
    gain_db = _smallest(found["conditions"], "gain_margin_db")
    phase_deg = _smallest(found["conditions"], "phase_margin_deg")
    good = all(
        value is None or value >= limit
        for value, limit in (
            (gain_db, wanted.gain_margin_db),
            (phase_deg, wanted.phase_margin_deg),
        )
    )
    margins = (
        "any gain" if gain_db is None else f"{gain_db:.1f} dB",
        "any phase" if phase_deg is None else f"{phase_deg:.0f} deg",
    )
    verdict = (
        "✓ The loop is stable"
        if good
        else "✗ The loop is nearly unstable: raise the controller's inertia or damping"
    )
    return f"{verdict}; smallest margins {' and '.join(margins)} ({asked})."


def _smallest(conditions: Mapping[str, Any], key: str) -> float | None:
    values = [margins[key] for margins in conditions.values() if margins[key] is not None]
    return min(values, default=None)


def _precision(found: Mapping[str, Any]) -> list[str]:
    """Say how precise the planned epochs of each condition are together."""
    lines = []
    for name, one in found.items():
        n, pooled = one["planned_epochs"], one["iv_pooled"]
        if not n or pooled is None:
            continue
        parts = ", ".join(
            f"{symbol} ± {100.0 * Z95 * pooled[key] / one['joint'][key]:.2g} %"
            for key, symbol in SYMBOLS.items()
            if one["joint"][key]
        )
        epochs = "1 epoch gives" if n == 1 else f"{n} epochs give"
        lines.append(
            f"{name}: {epochs} {parts} (95 % interval for the joint that the protocol assumes; "
            "what varies from epoch to epoch comes on top)."
        )
    return lines or ["The protocol has no epoch of PRBS, which alone gives J, B and K."]


def detected(primary: PrimaryTable) -> list[str]:
    """Return the options of `design` that plan for the primary measures of a study.

    Examples
    --------
    >>> detected(PrimaryTable(measures=["stiffness_nm_rad"]))
    ['--primary', 'stiffness_nm_rad', '--rule', 'holm', '--detect', 'stiffness=20%']
    """
    options = ["--primary", ",".join(primary.measures), "--rule", primary.rule]
    for name in (one.partition("_")[0] for one in primary.measures):
        if name in ("stiffness", "damping"):
            options += ["--detect", f"{name}={primary.difference_percent:g}%"]
    return options


def dry_run_lines(good: int, planned: int) -> list[str]:
    """Return what a run of the protocol on the virtual rig says of it."""
    if good == planned:
        return [f"✓ All {planned} epochs end with success on the virtual rig."]
    return [
        f"✗ Only {good} of {planned} epochs end with success on the virtual rig; below is what "
        "stopped the others."
    ]
