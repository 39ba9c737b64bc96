"""How often the tests of the lack of fit and of other bands are wrong, and how often right.

Recordings of one and of four epochs of the same PRBS. Without a misfit the share of p below 0.05
should be 5 %, and below 0.001 0.1 %; `lack_of_fit` needs less than 1e-4 over all tests of a
recording, and a misfit above `max_lack_of_fit_percent`. `band_sensitivity` is counted where it
doubts the fit to all epochs, whose interval is the narrowest. In the last rows the torque went
through a low-pass filter that its stamps do not know of: what the perturbation causes is then not
J, B and K.

    python -m benchmarks.lack_of_fit --recordings 100
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import signal

from rigidimeter.analysis.estimation import method_named
from rigidimeter.analysis.estimation.closedloop.band_sensitivity import band_finding
from rigidimeter.analysis.estimation.diagnostics.together import in_bands, lack_of_fit, misfits
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_chunks

JOINT = JointDynamics(0.0045, 0.1368, 1.751)
EPOCHS = 4
SUBJECTS: Mapping[str, Mapping[str, float]] = {
    "relaxed": {"voluntary_sd_nm": 0.0},
    "0.2 N·m voluntary": {"voluntary_sd_nm": 0.2},
    "0.5 N·m voluntary": {"voluntary_sd_nm": 0.5},
    "tremor of 0.3 N·m": {"voluntary_sd_nm": 0.0, "tremor_amplitude_nm": 0.3},
}
FILTER_HZ = 40.0


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=100)
    count = parser.parse_args(arguments).recordings
    print(
        "| recording | epochs | p < 0.05 | p < 0.001 | smallest p of all | lack_of_fit "
        "| bands: p < 0.05 | band_sensitivity |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, subject in SUBJECTS.items():
        _rows(name, subject, count, filtered=False)
    for name in ("relaxed", "0.2 N·m voluntary"):
        _rows(f"{name}, filter of {FILTER_HZ:g} Hz", SUBJECTS[name], count, filtered=True)


def _rows(name: str, subject: Mapping[str, float], count: int, *, filtered: bool) -> None:
    settings = parse_settings({"subject": {"OFF": dict(subject)}})
    p: dict[int, list[float]] = {1: [], EPOCHS: []}
    of_bands: dict[int, list[float]] = {1: [], EPOCHS: []}
    raised, doubted = dict.fromkeys(p, 0), dict.fromkeys(p, 0)
    batches = simulate_chunks(
        settings,
        count * EPOCHS,
        chunk=EPOCHS,
        joints=[JOINT] * (count * EPOCHS),
        conditions="OFF",
        seed=20,
    )
    for batch in batches:
        epochs = [batch.epoch(i) for i in range(EPOCHS)]
        if filtered:
            epochs = [_filtered(epoch) for epoch in epochs]
        for size in p:
            judged = _judged(epochs[:size], settings)
            p[size] += judged.p
            of_bands[size] += judged.p_of_bands
            raised[size] += judged.lack_of_fit
            doubted[size] += judged.band_sensitivity
    for size, values in p.items():
        found_p = np.array(values)
        print(
            f"| {name} | {size} | {100 * np.mean(found_p < 0.05):.1f} % "
            f"| {100 * np.mean(found_p < 0.001):.2f} % | {np.min(found_p):.1g} "
            f"| {raised[size]} of {count} "
            f"| {100 * np.mean(np.array(of_bands[size]) < 0.05):.1f} % "
            f"| {doubted[size]} of {count} |",
            flush=True,
        )


class _Judged(NamedTuple):
    p: list[float]
    p_of_bands: list[float]
    lack_of_fit: bool
    band_sensitivity: bool


def _judged(epochs: Sequence[Epoch], settings: Settings) -> _Judged:
    iv, prepared = method_named("iv"), prepare(epochs, settings)
    fits, pooled = iv.fit(prepared, None, lambda _: None, True)
    members = list(zip(prepared, fits, strict=True))
    observed, tests = misfits(members, iv)
    _, changes = in_bands(observed)
    return _Judged(
        [test.p for test in tests],
        [p for found in changes if found.part == "all" for p in found.p.tolist()],
        bool(lack_of_fit(tests, observed, settings.diagnostics)),
        bool(band_finding(pooled[0], changes, settings.diagnostics)),
    )


def _filtered(epoch: Epoch) -> Epoch:
    torque = epoch.channels["torque_nm"]
    sos = signal.butter(1, FILTER_HZ, fs=torque.rate_hz, output="sos")
    smooth = Channel(torque.name, torque.time_s, signal.sosfilt(sos, torque.values))
    return replace(epoch, channels={**epoch.channels, torque.name: smooth})


if __name__ == "__main__":
    main()
