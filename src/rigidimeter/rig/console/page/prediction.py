"""What is predicted of a session, in sentences that say what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import NormalDist
from typing import Any

from rigidimeter.core.settings import MarginsSettings

SYMBOLS = {"inertia_kg_m2": "J", "damping_nm_s_rad": "B", "stiffness_nm_rad": "K"}
Z95 = NormalDist().inv_cdf(0.975)
"""Standard errors on either side in a 95 % interval."""


def prediction_lines(document: Mapping[str, Any], wanted: MarginsSettings) -> list[str]:
    """Return the sentences on stability, precision, days needed and limits.

    Parameters
    ----------
    document : mapping
        A `rigidimeter.design/2`.
    wanted : MarginsSettings
        The margins that are required.
    """
    return [
        _stability(document["stability"], wanted),
        *_precision(document["precision"]),
        *_days(document["detection"]),
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


def _days(found: list[Mapping[str, Any]]) -> list[str]:
    """Say how many days like the planned one show a difference, and what that assumes."""
    lines = []
    for one in found:
        percent = 100.0 * one["difference"] / one["value"]
        what = (
            f"a {one['parameter']} {'lower' if percent > 0 else 'higher'} by {abs(percent):.3g} % "
            f"({abs(one['difference']):.3g} {one['unit']})"
        )
        planned = one["planned"]
        if planned is None:
            lines.append(
                f"! To show {what} a day needs PRBS in two conditions, which the protocol has not."
            )
            continue
        days, holm, subjects = (
            "more than 1000" if planned[key] is None else f"{planned[key]}"
            for key in ("days_needed", "days_needed_holm", "subjects_needed")
        )
        lines.append(
            f"{days} days like this one, with {' and '.join(map(str, planned['epochs_a_day']))} "
            f"epochs, show {what} with {100.0 * one['power']:.0f} % power; {holm} if J, B and K "
            f"are all tested (Holm); of subjects with one day each {subjects}. Assumed: "
            f"{_assumed(one['scatter'])}."
        )
    return lines


def _assumed(scatter: Mapping[str, Any]) -> str:
    return (
        f"SD of {scatter['between_epochs_percent']:.2g} % between epochs and "
        f"{scatter['condition_in_day_percent']:.2g} % of one condition between days "
        f"({scatter['source']})"
    )


def dry_run_lines(good: int, planned: int) -> list[str]:
    """Return what a run of the protocol on the virtual rig says of it."""
    if good == planned:
        return [f"✓ All {planned} epochs end with success on the virtual rig."]
    return [
        f"✗ Only {good} of {planned} epochs end with success on the virtual rig; below is what "
        "stopped the others."
    ]
