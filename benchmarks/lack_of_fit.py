"""How often the tests of the lack of fit are wrong, and how often right.

Recordings of one and of four epochs of the same PRBS. Without a misfit the share of p below 0.05
should be 5 %, and below 0.001 0.1 %; `lack_of_fit` needs less than 1e-4 over all tests of a
recording, and a misfit above `lack_of_fit_most_percent`. In the last rows the torque went through
a low-pass filter that its stamps do not know of: what the perturbation causes is then not J, B, K.

    python -m benchmarks.lack_of_fit --recordings 100
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy import signal

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.estimation import method_named
from rigidimeter.estimation.diagnostics.together import lack_of_fit, misfits
from rigidimeter.estimation.prepared import prepare
from rigidimeter.records import Channel, Epoch
from rigidimeter.settings import Settings, parse_settings
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
    print("| recording | epochs | p < 0.05 | p < 0.001 | smallest p of all | lack_of_fit |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, subject in SUBJECTS.items():
        _rows(name, subject, count, filtered=False)
    for name in ("relaxed", "0.2 N·m voluntary"):
        _rows(f"{name}, filter of {FILTER_HZ:g} Hz", SUBJECTS[name], count, filtered=True)


def _rows(name: str, subject: Mapping[str, float], count: int, *, filtered: bool) -> None:
    settings = parse_settings({"subject": {"OFF": dict(subject)}})
    p: dict[int, list[float]] = {1: [], EPOCHS: []}
    raised = dict.fromkeys(p, 0)
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
            tests, found = _judged(epochs[:size], settings)
            p[size] += tests
            raised[size] += found
    for size, values in p.items():
        found_p = np.array(values)
        print(
            f"| {name} | {size} | {100 * np.mean(found_p < 0.05):.1f} % "
            f"| {100 * np.mean(found_p < 0.001):.2f} % | {np.min(found_p):.1g} "
            f"| {raised[size]} of {count} |",
            flush=True,
        )


def _judged(epochs: Sequence[Epoch], settings: Settings) -> tuple[list[float], bool]:
    iv, prepared = method_named("iv"), prepare(epochs, settings)
    fits, _ = iv.fit(prepared, None, lambda _: None, False)
    members = list(zip(prepared, fits, strict=True))
    _, tests = misfits(members, iv)
    return [test.p for test in tests], lack_of_fit(members, iv) is not None


def _filtered(epoch: Epoch) -> Epoch:
    torque = epoch.channels["torque_nm"]
    sos = signal.butter(1, FILTER_HZ, fs=torque.rate_hz, output="sos")
    smooth = Channel(torque.name, torque.time_s, signal.sosfilt(sos, torque.values))
    return replace(epoch, channels={**epoch.channels, torque.name: smooth})


if __name__ == "__main__":
    main()
