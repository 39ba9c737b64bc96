"""How far the estimates can be trusted: bias, scatter against the bound, coverage, delay.

A documented experiment on the virtual rig, per-degree controller, from fixed seeds. Run by hand,

    python -m benchmarks.accuracy

about half an hour on a busy core; the tables go to `docs/development/accuracy.md`.

    python -m benchmarks.accuracy --share 0.1               # fewer runs; writes nothing
    python -m benchmarks.accuracy --only relaxed delay      # these sections of the page alone
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tests.docs.measured import folded

from benchmarks import hard_epochs, two_rigs
from benchmarks.known_joint import TRUTH, array, sessions, settings_with
from rigidimeter.analysis.estimation import estimate_recorded, fit_epoch, prepare
from rigidimeter.core.records import Channel, Epoch, Fit
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE, Settings
from rigidimeter.planning import prbs_nm, predicted_precision
from rigidimeter.virtual import PAPER_RATES

TABLE = Path(__file__).parent.parent / "docs" / "development" / "accuracy.md"


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """Return a Markdown table, to unfold."""
    lines = [
        "| " + " | ".join(header) + " |",
        "| " + " | ".join(["---", *["---:"] * (len(header) - 1)]) + " |",
        *("| " + " | ".join(map(str, row)) + " |" for row in rows),
    ]
    return [*folded(lines), ""]


def percent(values: Iterable[float], digits: int = 2) -> list[str]:
    """Return shares as percentages with a sign."""
    return [f"{100 * value:+.{digits}f}" for value in values]


def fitted(epochs: Sequence[Epoch], method: str, settings: Settings) -> Sequence[Fit]:
    """Return the fits of the epochs of one recording."""
    recorded = prepare(epochs, settings, clocks=False)
    return estimate_recorded(recorded, method, fits_alone=True).fits


def pooled_bias(n: int) -> list[str]:
    """Pooled estimates of a subject who pushes, and the mean of least squares, over n epochs."""
    rows = []
    for sd in (0.2, 0.5):
        settings = settings_with(sd)
        pooled: dict[str, list[Fit]] = {method: [] for method in ("iv", "spectral")}
        squares: list[Fit] = []
        excluded = 0
        for epochs in sessions(settings, n, 11):
            recorded = prepare(epochs, settings, clocks=False)
            excluded += sum(not epoch.closed.included for epoch in epochs)
            for method, found in pooled.items():
                found += estimate_recorded(recorded, method).pooled[:1]
            squares += fitted(epochs[:3], "bandlimited", settings)
        for method, found in pooled.items():
            error = array(found) / TRUTH - 1
            se = error.std(0, ddof=min(1, len(found) - 1)) / np.sqrt(len(found))
            rows.append(
                [
                    f"{sd} N·m, {method}, mean of {len(found)} recordings",
                    *(
                        f"{100 * e:+.2f} ± {100 * s:.2f}"
                        for e, s in zip(error.mean(0), se, strict=True)
                    ),
                ]
            )
        rows.append(
            [
                f"{sd} N·m, bandlimited, mean of {len(squares)}, three a recording",
                *percent(np.mean(array(squares), 0) / TRUTH - 1),
            ]
        )
        if excluded:
            rows.append([f"{sd} N·m: {excluded} of {n} epochs touched the limit", "", "", ""])
    return [
        "## Voluntary torque",
        "",
        f"Voluntary torque of the given SD, 0.3 to 4 Hz; {n} epochs, pooled by recording. Errors "
        "of J, B and K in %, ± one standard error of the mean.",
        "",
        *table(["voluntary torque, method", "J", "B", "K"], rows),
    ]


def bounds(settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Return the Cramér–Rao bound over all frequencies, and what the end of the band costs.

    That is the predicted standard error of `iv` within its band over that up to the highest
    frequency that the torque's rate allows. Each has shape (3,).
    """

    def predicted(high_hz: float) -> Any:
        estimation = settings.estimation.model_copy(update={"band_high_closed_loop_hz": high_hz})
        within = settings.model_copy(update={"estimation": estimation})
        torque_nm = prbs_nm(within.prbs, within.rig.tick_rate_hz)
        return predicted_precision(torque_nm, within, within.subject["OFF"])

    cut = predicted(settings.estimation.band_high_closed_loop_hz)
    uncut = predicted(USABLE_FRACTION_OF_RATE * settings.rig.torque.rate_hz)
    return np.array(cut.bound.free), np.array(cut.iv.free) / np.array(uncut.iv.free)


def efficiency(title: str, voluntary_sd_nm: float, methods: Sequence[str], n: int) -> list[str]:
    """Scatter against the bounds, bias in SDs, coverage."""
    settings = settings_with(voluntary_sd_nm)
    fits: dict[str, list[Fit]] = {method: [] for method in methods}
    alone: list[Fit] = []
    for epochs in sessions(settings, n, 12):
        for method in methods:
            fits[method] += fitted(epochs, method, settings)
        alone += [fit_epoch(epoch, "iv", settings) for epoch in epochs]
    bound = np.median(array(fits["iv"], "_bound"), 0)
    everywhere, cost = bounds(settings)
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
                " ".join(f"{x:.2f}" for x in spread / everywhere),
                " ".join(f"{x:+.2f}" for x in (values.mean(0) - TRUTH) / spread),
                " ".join(f"{100 * x:.1f}" for x in covered.mean(0)),
                " ".join(f"{100 * x:.3g}" for x in spread / TRUTH),
            ]
        )
    return [
        f"### {title}, {n} runs",
        "",
        f"Bound within the band: {_shares(bound)}; over all frequencies: {_shares(everywhere)}. "
        f"The end of the band at {settings.estimation.band_high_closed_loop_hz:g} Hz makes the "
        f"predicted standard errors of iv {cost[0]:.2f}, {cost[1]:.2f} and {cost[2]:.2f} times "
        "those without it.",
        "",
        *table(
            ["method", "SD / bound", "SD / bound, all", "bias / SD", "coverage (%)", "SD (%)"], rows
        ),
    ]


def _shares(values: np.ndarray) -> str:
    return ", ".join(f"{100 * x:.3g} %" for x in values / TRUTH)


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
                        (found,) = prepare(moved, settings).delays
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
        for method in ("iv", "spectral", "bandlimited"):
            kept.setdefault(method, []).extend(fitted(epochs, method, settings))
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
    fits = [fit for epochs in sessions(settings, n, 34) for fit in fitted(epochs, "iv", settings)]
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


def rigs(n: int) -> list[str]:
    """Single epochs on the virtual rig and on an independent one."""
    return [
        "## Two rigs",
        "",
        f"{n} epochs of 20 s each, in recordings of {two_rigs.SESSION}: of the virtual rig, and of "
        "one in continuous time that shares nothing with it "
        "(`tests/scenarios/independent_rig.py`: a PI drive that its load slows down, another "
        "controller and perturbation, voluntary torque with soft skirts, tremor that drifts). "
        "Numbers are for J, B, K; coverage is that of 95 % intervals; SE / SD is the median "
        "standard error over the SD.",
        "",
        *table(two_rigs.HEADER, two_rigs.rows(n)),
    ]


def lost(n: int) -> list[str]:
    """Epochs of which a stretch is lost."""
    start_s, stop_s = hard_epochs.LOST_S
    return [
        "## A stretch that is lost",
        "",
        f"`iv`, {n} epochs of 20 s with 0.1 N·m of voluntary torque, each fitted alone; what was "
        f"measured from {start_s:g} to {stop_s:g} s is lost. In % for J, B, K.",
        "",
        *table(hard_epochs.LOST_HEADER, hard_epochs.lost_rows(n)),
    ]


def pushed(n: int) -> list[str]:
    """Torque and motion alone, the subject pushing up to over all of the band."""
    return [
        "## Torque of the subject over all of the band",
        "",
        f"`bandlimited` on torque and motion alone, {n} epochs of 20 s a row, single epochs. In % "
        "for J, B, K.",
        "",
        *table(hard_epochs.PUSHED_HEADER, hard_epochs.pushed_rows(n)),
    ]


PARTS: Mapping[str, tuple[Callable[[int], list[str]], int]] = {
    "pooled": (pooled_bias, 1000),
    "relaxed": (
        partial(
            efficiency,
            "White sensor noise of 5 mN·m, 1 kHz",
            0.0,
            ("iv", "spectral", "bandlimited", "published"),
        ),
        500,
    ),
    "voluntary-0.2": (
        partial(efficiency, "Voluntary torque of 0.2 N·m", 0.2, ("iv", "spectral", "bandlimited")),
        500,
    ),
    "voluntary-0.5": (
        partial(efficiency, "Voluntary torque of 0.5 N·m", 0.5, ("iv", "spectral")),
        500,
    ),
    "two-rigs": (rigs, 200),
    "lost": (lost, 200),
    "pushed": (pushed, 100),
    "delay": (delay, 50),
    "rates": (paper_rates, 100),
    "section-3.4": (section_3_4, 100),
}
"""The sections of the page, each with its runs."""


def main() -> None:
    """Measure what is asked for, and bring the page up to date."""
    parser = argparse.ArgumentParser(description="bias, scatter, coverage and delay")
    parser.add_argument("--share", type=float, default=1.0, help="of the runs of each section")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    options = parser.parse_args()
    page = TABLE.read_text(encoding="utf-8")
    for name in options.only:
        part, runs = PARTS[name]
        lines = part(max(round(runs * options.share), 2))
        print("\n".join(lines), flush=True)
        if options.share == 1.0:
            page = replaced(page, lines)
            TABLE.write_text(page, encoding="utf-8")


def replaced(page: str, lines: Sequence[str]) -> str:
    """Return the page with the section of that heading replaced."""
    heading = re.escape(lines[0])
    section = re.compile(rf"^{heading}$.*?(?=^##|\Z)", re.M | re.S)
    text = "\n".join(lines).rstrip() + "\n\n"
    if not section.search(page):
        raise SystemExit(f"{TABLE}: there is no section {lines[0]!r}")
    return section.sub(lambda _: text, page).rstrip() + "\n"


if __name__ == "__main__":
    main()
