"""Bursts of EMG that are found and missed, and J, B and K with and without active stretches.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks.active_stretches --epochs 200

The subject of the virtual rig pushes, or trembles, twice in 20 s for 0.5 to 1.5 s. Two muscles have
the EMG of the virtual subject as `[emg]` has it by default: at 2 kHz, 200 µV for each N·m that the
muscle gives 50 ms later, 4 µV of noise and 2 µV of hum. The reflex is that of a joint simulated
with it. Epochs that are fitted with their active stretches are fitted without their EMG, which is
the same and takes a third of the time.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from tests.pushes import JOINT, Pushed, epochs_with_emg, with_reflex_emg
from tests.scenarios.recordings import measured_alone
from tests.scenarios.scenario import scenario

from rigidimeter.analysis.estimation import estimate_recorded, prepare
from rigidimeter.core.records import Activity, Epoch
from rigidimeter.core.settings import Settings

SESSION = 25
SUBJECTS = {
    "relaxed": {},
    "voluntary, 0.2 N·m": {"voluntary_nm": 0.2},
    "voluntary, 0.5 N·m": {"voluntary_nm": 0.5},
    "tremor of 0.3 N·m, 5 Hz": {"tremor_nm": 0.3},
}
TRUTH = np.array([JOINT.inertia_kg_m2, JOINT.damping_nm_s_rad, JOINT.stiffness_nm_rad])
REFLEX_LATE_S = 0.1
"""From the stretch to the torque: 50 ms to the EMG, which is the electromechanical delay before."""
FOUND_HEADER = [
    "subject",
    "epochs",
    "bursts",
    "missed (%)",
    "false bursts per minute of rest",
    "rest marked (%)",
    "muscles taken for following the motion (%), without the perturbation",
]
FITTED_HEADER = ["subject", "method", "active stretches", "bias (%)", "SD (%)", "held"]
REFLEX_HEADER = [
    "reflex (N·m·s/rad)",
    "epochs",
    "muscles with bursts",
    "stay in (%), perturbation recorded",
    "stay in (%), not recorded",
]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--epochs", type=int, default=50, help="of each subject")
    parser.add_argument("--only", choices=("found", "fitted", "reflex"))
    arguments = parser.parse_args()
    tables = {
        "found": (FOUND_HEADER, found_rows),
        "fitted": (FITTED_HEADER, fitted_rows),
        "reflex": (REFLEX_HEADER, reflex_rows),
    }
    for name, (header, rows) in tables.items():
        if arguments.only in (None, name):
            print(f"\n| {' | '.join(header)} |\n|{' --- |' * len(header)}")
            for row in rows(arguments.epochs):
                print(f"| {' | '.join(map(str, row))} |", flush=True)


def recordings(
    n: int, pushes: int = 2, **subject: float
) -> Iterator[tuple[Settings, list[Pushed]]]:
    """Yield so many epochs of a subject in sessions."""
    for start in range(0, n, SESSION):
        yield epochs_with_emg(min(SESSION, n - start), seed=100 + start, **subject)


def found_rows(n: int) -> Iterator[Sequence[object]]:
    """Yield how many pushes the EMG shows, and what it shows beside them."""
    for name, subject in SUBJECTS.items():
        pushes = missed = false = 0
        rest_s = marked_s = 0.0
        locked: list[list[bool]] = [[], []]
        for settings, epochs in recordings(n, **subject):
            recorded = [one.epoch for one in epochs]
            for known, seen in enumerate((recorded, list(map(without_causes, recorded)))):
                ready = prepare(seen, settings, clocks=False).perturbed
                activities = [one.activity for one in ready]
                for one, activity in zip(epochs, activities, strict=True):
                    assert activity is not None
                    locked[known] += _locked(activity)
                    if known:
                        continue
                    pushes += len(one.pushes)
                    missed += sum(
                        not any(map(near(push), activity.stretches)) for push in one.pushes
                    )
                    own = (sum(near(s)(push) for push in one.pushes) for s in activity.stretches)
                    false += sum(count == 0 for count in own)
                    rest, marked = _rest_marked(one, activity)
                    rest_s, marked_s = rest_s + rest, marked_s + marked
        yield (
            name,
            n,
            pushes,
            f"{100 * missed / pushes:.1f}" if pushes else "–",
            f"{60 * false / rest_s:.2f}",
            f"{100 * marked_s / rest_s:.2f}",
            " and ".join(f"{100 * np.mean(one):.1f}" if one else "–" for one in locked),
        )


def near(span: Sequence[float]):
    """Return what tells whether another span overlaps."""
    return lambda other: other[0] < span[1] and other[1] > span[0]


def _locked(activity: Activity) -> list[bool]:
    by_muscle = {one.channel: one.locked for one in activity.stretches}
    return list(by_muscle.values())


def _rest_marked(one: Pushed, activity: Activity) -> tuple[float, float]:
    time_s = np.arange(0.0, 20.0, 0.01)
    pushed, marked = (
        np.any([(time_s >= a) & (time_s <= b) for a, b, *_ in spans] or [time_s < 0], axis=0)
        for spans in (one.pushes, activity.stretches)
    )
    return 0.01 * np.count_nonzero(~pushed), 0.01 * np.count_nonzero(~pushed & marked)


def without_causes(epoch: Epoch) -> Epoch:
    """Return an epoch of torque, motion and EMG alone."""
    alone = measured_alone(epoch)
    emg = {name: one for name, one in epoch.channels.items() if name.startswith("emg")}
    return Epoch(epoch.source, epoch.label, {**alone.channels, **emg}, epoch.condition, epoch.task)


def without_emg(epoch: Epoch) -> Epoch:
    """Return an epoch without its EMG."""
    channels = {name: one for name, one in epoch.channels.items() if not name.startswith("emg")}
    return replace(epoch, channels=channels)


def fitted_rows(n: int) -> Iterator[Sequence[object]]:
    """Yield bias, SD and coverage of J, B and K, with active stretches left out and with them."""
    for name, subject in SUBJECTS.items():
        found: dict[tuple[str, str], list] = {}
        for settings, epochs in recordings(n, **subject):
            recorded = [one.epoch for one in epochs]
            seen = {"iv": recorded, "bandlimited": list(map(without_causes, recorded))}
            for method, own in seen.items():
                for way, each in (("left out", own), ("fitted", list(map(without_emg, own)))):
                    prepared = prepare(each, settings, clocks=False)
                    fits = estimate_recorded(prepared, method, fits_alone=True).fits
                    found.setdefault((method, way), []).extend(fits)
        for (method, way), fits in sorted(found.items(), reverse=True):
            values = np.array([fit.value for fit in fits]) / TRUTH - 1
            held = [(fit.low <= TRUTH) & (fit.high >= TRUTH) for fit in fits]
            numbers = (
                _three(100 * values.mean(axis=0), "+.2f"),
                _three(100 * values.std(axis=0, ddof=1), ".2f") if len(fits) > 1 else "–",
                _three(100 * np.mean(held, axis=0), ".0f"),
            )
            yield name, method, way, *numbers


def reflex_rows(n: int) -> Iterator[Sequence[object]]:
    """Yield in how many epochs a muscle that answers the velocity stays in."""
    for gain in (0.05, 0.1, 0.2, 0.5):
        reflex = {"reflex_nm_s_rad": gain, "reflex_delay_s": REFLEX_LATE_S, "reflex_sides": 2.0}
        joint = scenario(f"reflex of {gain}", joint=reflex)
        settings, rng = joint.analysed_with(), np.random.default_rng(7)
        kept: list[list[bool]] = [[], []]
        for start in range(0, n, SESSION):
            epochs = joint.simulated(start, min(SESSION, n - start)).epochs
            own = [with_reflex_emg(one, gain, REFLEX_LATE_S, rng) for one in epochs]
            for known, seen in enumerate((own, list(map(without_causes, own)))):
                for one in prepare(seen, settings, clocks=False).perturbed:
                    assert one.activity is not None
                    kept[known] += _locked(one.activity)
        share = [f"{100 * np.mean(one):.1f}" if one else "–" for one in kept]
        yield gain, n, len(kept[0]), *share


def _three(values: np.ndarray, digits: str) -> str:
    return " ".join(f"{value:{digits}}" for value in values)


if __name__ == "__main__":
    main()
