"""How far the estimates can be trusted: bias, scatter against the bound, coverage, delay.

A documented experiment on the virtual rig, per-degree controller, from fixed seeds. Run by hand,

    python -m benchmarks.accuracy

about half an hour on a busy core; the tables go to `docs/reference/accuracy.md`. With a number it
takes that fraction of the runs, for a quick look that writes nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.estimation import estimate_delays, fit_epochs
from rigidimeter.estimation.closedloop.linear_problems import least_squares_start
from rigidimeter.estimation.closedloop.perturbation_methods import CLOSED_LOOP
from rigidimeter.estimation.closedloop.refine import fit_pooled
from rigidimeter.estimation.prepared import PreparedEpoch, Source, prepare
from rigidimeter.records import Channel, Epoch, Fit
from rigidimeter.settings import EstimationSettings, Settings, parse_settings
from rigidimeter.virtual.batch import simulate_chunks
from rigidimeter.virtual.study_design import PAPER_RATES

TABLE = Path(__file__).parent.parent / "docs" / "reference" / "accuracy.md"
NAMES = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
JOINT = JointDynamics(0.0045, 0.1368, 1.751)
TRUTH = np.array([JOINT.inertia_kg_m2, JOINT.damping_nm_s_rad, JOINT.stiffness_nm_rad])
SESSION = 25
"""Epochs that are fitted together, as those of a session would be."""


def settings_with(voluntary_sd_nm: float = 0.0, **rig: Any) -> Settings:
    """Return the defaults with a subject of known joint."""
    return parse_settings(
        {
            "subject": {"OFF": {"voluntary_sd_nm": voluntary_sd_nm}},
            "protocol": {"blocks": [{"epochs": 1}]},
            "rig": rig,
        }
    )


def sessions(settings: Settings, n: int, seed: int) -> Iterator[list[Epoch]]:
    """Yield epochs in sessions."""
    joints = [JOINT] * n
    for batch in simulate_chunks(
        settings, n, chunk=SESSION, joints=joints, conditions="OFF", seed=seed, workers=2
    ):
        yield [batch.epoch(i) for i in range(len(batch))]


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """Return a Markdown table."""
    return [
        "| " + " | ".join(header) + " |",
        "| " + " | ".join(["---", *["---:"] * (len(header) - 1)]) + " |",
        *("| " + " | ".join(map(str, row)) + " |" for row in rows),
        "",
    ]


def percent(values: Iterable[float], digits: int = 2) -> list[str]:
    """Return shares as percentages with a sign."""
    return [f"{100 * value:+.{digits}f}" for value in values]


def array(fits: Sequence[Fit], ending: str = "") -> np.ndarray:
    """Return one number of each parameter, shape (fits, 3)."""
    return np.array([[getattr(fit, name + ending) for name in NAMES] for fit in fits])


def pooled_bias(n: int) -> list[str]:
    """Pooled estimates over n epochs of a subject who pushes, and the mean of least squares."""
    rows = []
    for sd in (0.2, 0.5):
        settings = settings_with(sd)
        kept: dict[str, list[Any]] = {method: [] for method in CLOSED_LOOP}
        squares, excluded, first = [], 0, None
        source: Source | None = None
        for epochs in sessions(settings, n, 11):
            good = [epoch for epoch in epochs if epoch.closed.included]
            excluded += len(epochs) - len(good)
            source = source or Source(good, settings)
            for epoch in good:
                first = first or epoch.channels["perturbation_nm"]
                shared = replace(
                    epoch, channels={**epoch.channels, "perturbation_nm": first}
                )  # one copy of the sequence is enough
                prepared = PreparedEpoch(shared, settings, source)
                for method, members in kept.items():
                    members.append(CLOSED_LOOP[method].observe(prepared))
            squares += fit_epochs(good[:3], "bandlimited", settings)[0]
        for method, observations in kept.items():
            start = least_squares_start(observations)
            fit, _ = fit_pooled(observations, CLOSED_LOOP[method].linearise, start)
            error, se = fit.values / TRUTH - 1, fit.standard_errors / TRUTH
            rows.append(
                [
                    f"{sd} N·m, {method}, pooled over {len(observations)}",
                    *(f"{100 * e:+.2f} ± {100 * s:.2f}" for e, s in zip(error, se, strict=True)),
                ]
            )
        rows.append(
            [
                f"{sd} N·m, bandlimited, mean of {len(squares)}",
                *percent(np.mean(array(squares), 0) / TRUTH - 1),
            ]
        )
        if excluded:
            rows.append([f"{sd} N·m: {excluded} of {n} epochs touched the limit", "", "", ""])
    return [
        "## Voluntary torque",
        "",
        "Voluntary torque of the given SD, 0.3 to 4 Hz. Errors of J, B and K in %, ± one standard "
        "error.",
        "",
        *table(["voluntary torque, method", "J", "B", "K"], rows),
    ]


def efficiency(n: int) -> list[str]:
    """Scatter against the bound, bias in SDs, coverage; white noise, then voluntary torque."""
    out = [
        "## Scatter, bias and coverage of single epochs",
        "",
        f"Sessions of {SESSION} epochs of 20 s. SD relative to the Cramér–Rao bound within the "
        f"band of iv, {EstimationSettings().band_high_closed_loop_hz:g} Hz (`rigidimeter design` "
        "prints the bound over all frequencies); bias in SDs of an "
        "epoch; coverage of 95 % intervals in %. Each for J, B, K.",
        "",
    ]
    for title, sd, methods, draws in (
        (
            "White sensor noise of 5 mN·m, 1 kHz",
            0.0,
            ("iv", "ml", "spectral", "bandlimited", "published"),
            n,
        ),
        ("Voluntary torque of 0.2 N·m", 0.2, ("iv", "ml", "spectral", "bandlimited"), n),
        ("Voluntary torque of 0.5 N·m", 0.5, ("iv", "ml"), n),
    ):
        settings = settings_with(sd)
        fits: dict[str, list[Fit]] = {method: [] for method in methods}
        alone: list[Fit] = []
        for epochs in sessions(settings, draws, 12):
            for method in methods:
                fits[method] += fit_epochs(epochs, method, settings)[0]
            alone += [fit_epochs([epoch], "iv", settings)[0][0] for epoch in epochs]
        bound = np.median(array(fits["iv"], "_bound"), 0)
        rows = []
        for method, found in [*fits.items(), ("iv, each epoch alone", alone)]:
            good = [fit for fit in found if fit.n_samples]
            values = array(good)
            spread = values.std(0, ddof=1)
            covered = (array(good, "_low") <= TRUTH) & (array(good, "_high") >= TRUTH)
            rows.append(
                [
                    method,
                    " ".join(f"{x:.2f}" for x in spread / bound),
                    " ".join(f"{x:+.2f}" for x in (values.mean(0) - TRUTH) / spread),
                    " ".join(f"{100 * x:.1f}" for x in covered.mean(0)),
                    " ".join(f"{100 * x:.3g}" for x in spread / TRUTH),
                ]
            )
        out += [
            f"### {title}, {draws} runs",
            "",
            "Bound: " + ", ".join(f"{100 * x:.3g} %" for x in bound / TRUTH) + ".",
            "",
            *table(["method", "SD / bound", "bias / SD", "coverage (%)", "SD (%)"], rows),
        ]
    return out


def delay(n: int) -> list[str]:
    """A torque stamped late, at 1 kHz and at the paper's rates."""
    rows = []
    for name, rig in (("1 kHz", {}), ("the paper's rates", PAPER_RATES)):
        for sd in (0.0, 0.2):
            for late_s in (0.0, 0.007, -0.003):
                settings = settings_with(sd, **rig)
                errors, claimed = [], []
                for epochs in sessions(settings, n, 13):
                    for i in range(0, len(epochs), 5):
                        moved = [_late(epoch, late_s) for epoch in epochs[i : i + 5]]
                        (found,) = estimate_delays({"batch": prepare(moved, settings)})
                        errors.append(found.delay_s - late_s)
                        claimed.append(found.delay_s_se)
                worst = 1e3 * np.max(np.abs(errors))
                rows.append(
                    [
                        f"{name}, {sd} N·m, {1e3 * late_s:g} ms",
                        f"{1e3 * np.mean(errors):+.4f}",
                        f"{1e3 * np.std(errors):.4f}",
                        f"{1e3 * np.median(claimed):.4f}",
                        f"{worst:.4f}",
                    ]
                )
    return [
        "## Delay of the torque",
        "",
        f"Estimated from five epochs, {max(n // 5, 1)} times; errors in ms.",
        "",
        *table(
            ["rates, voluntary torque, injected", "mean error", "SD", "standard error", "largest"],
            rows,
        ),
    ]


def _late(epoch: Epoch, late_s: float) -> Epoch:
    torque = epoch.channels["torque_nm"]
    moved = Channel("torque_nm", torque.time_s + late_s, torque.values)
    return replace(epoch, source="batch", channels={**epoch.channels, "torque_nm": moved})


def paper_rates(n: int) -> list[str]:
    """Torque at 100 samples/s, motion at 50 with jitter up to 5 ms."""
    settings = settings_with(0.0, **PAPER_RATES)
    rows = []
    kept: dict[str, list[Fit]] = {}
    for epochs in sessions(settings, n, 14):
        for method in ("iv", "ml", "spectral", "bandlimited"):
            kept.setdefault(method, []).extend(fit_epochs(epochs, method, settings)[0])
    for method, fits in kept.items():
        error = array(fits) / TRUTH - 1
        rows.append(
            [
                method,
                *(
                    f"{100 * m:+.3f} ± {100 * s:.3f}"
                    for m, s in zip(error.mean(0), error.std(0), strict=True)
                ),
            ]
        )
    return [
        "## The paper's rates",
        "",
        f"Mean error and SD in % over {n} epochs; 5 ms of jitter.",
        "",
        *table(["method", "J", "B", "K"], rows),
    ]


def section_3_4(n: int) -> list[str]:
    """Sec. 3.4: closed loop with sensor noise, 100 runs."""
    settings = settings_with()
    fits = [
        fit for epochs in sessions(settings, n, 34) for fit in fit_epochs(epochs, "iv", settings)[0]
    ]
    error = array(fits) - TRUTH
    bound = np.median(array(fits, "_bound"), 0)
    printed_mean, printed_sd = (-1.9e-7, -2.6e-7, -1.9e-7), (9.6e-7, 1.05e-6, 1.4e-6)
    rows = []
    for i, unit in enumerate(("J, kg·m²", "B, N·m·s/rad", "K, N·m/rad")):
        sd = error[:, i].std(ddof=1)
        z = error[:, i].mean() / (sd / np.sqrt(n))
        rows.append(
            [
                unit,
                f"{error[:, i].mean():+.2e}",
                f"{z:+.2f}",
                f"{sd:.2e}",
                f"{bound[i]:.2e}",
                f"{printed_mean[i]:.1e}",
                f"{printed_sd[i]:.2e}",
            ]
        )
    ratio = " : ".join(f"{x / bound[2]:.3g}" for x in bound)
    printed = " : ".join(f"{x / printed_sd[2]:.2g}" for x in printed_sd)
    return [
        f"## Sec. 3.4: {n} runs with sensor noise of 5 mN·m",
        "",
        *table(
            ["", "mean error", "in standard errors", "SD", "bound", "paper: mean", "paper: SD"],
            rows,
        ),
        f"The bound's SDs of J, B and K have the ratio {ratio} for any level of white torque "
        f"noise; the paper's have {printed}. No white torque noise reproduces the paper's three "
        "numbers at once.",
        "",
    ]


def main() -> None:
    """Run all of it and write the page."""
    share = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0

    def runs(n: int) -> int:
        return max(round(n * share), 2)

    lines = [
        "# Accuracy",
        "",
        "Measured on the virtual rig with `python -m benchmarks.accuracy`; J 0.0045 kg·m², "
        "B 0.1368 N·m·s/rad, K 1.751 N·m/rad, controller per degree, fixed seeds.",
        "",
    ]
    for part in (
        pooled_bias(runs(1000)),
        efficiency(runs(500)),
        delay(runs(50)),
        paper_rates(runs(100)),
        section_3_4(runs(100)),
    ):
        print("\n".join(part), flush=True)
        lines += part
    if share == 1.0:
        TABLE.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
