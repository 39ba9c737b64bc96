"""Which model `rigidimeter model --compare` recommends for joints whose terms are known.

Epochs of the independent simulator of `tests.scenarios`, with or without the column of the
perturbation; and torques that are no joint's. For each row the share of the epochs in which each
kind of term is recommended, and in which no model is.

    python -m benchmarks.model_terms --epochs 100
    python -m benchmarks.model_terms --epochs 10 --only voluntary friction
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from tests.scenarios.recordings import measured_alone
from tests.scenarios.scenario import Scenario, scenario

from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording import fit_terms
from rigidimeter.core.records import Channel, Epoch

Array = NDArray[np.float64]
TERMS = "inertia,damping,stiffness,reflex,cubic,directional-damping,coulomb"
KINDS = {"reflex": "reflex", "coulomb": "friction", "cubic": "cubic", "damping+": "direction"}

JOINTS: tuple[Scenario, ...] = (
    scenario("relaxed"),
    scenario("voluntary 0.2 N·m", subject={"voluntary_nm": 0.2}),
    scenario("voluntary 0.5 N·m", subject={"voluntary_nm": 0.5}),
    scenario("tremor 0.3 N·m", subject={"tremor_nm": 0.3}),
    scenario("tremor 1 N·m", subject={"tremor_nm": 1.0}),
)
PRESENT: tuple[tuple[str, dict[str, float]], ...] = (
    ("reflex 0.05", {"reflex_nm_s_rad": 0.05, "reflex_delay_s": 0.045}),
    ("reflex 0.15", {"reflex_nm_s_rad": 0.15, "reflex_delay_s": 0.045}),
    ("friction 0.02 N·m", {"coulomb_nm": 0.02}),
    ("friction 0.1 N·m", {"coulomb_nm": 0.1}),
    ("cubic 40 N·m/rad³", {"cubic_nm_rad3": 40.0}),
    ("damping 3:1 by direction", {"damping_asymmetry": 0.5}),
)


def unrelated(angle: Array, rng: np.random.Generator) -> Array:
    """Return noise below 10 Hz that has nothing to do with the motion."""
    lines = rng.standard_normal(angle.size // 2 + 1) * np.exp(
        2j * np.pi * rng.uniform(size=angle.size // 2 + 1)
    )
    lines[np.arange(lines.size) * 1000.0 / angle.size > 10.0] = 0.0
    values = np.fft.irfft(lines, angle.size)
    return np.asarray(0.3 * values / values.std())


def gravity(angle: Array, rng: np.random.Generator) -> Array:
    """Return a gravity compensation: exactly a function of the angle."""
    del rng
    return 1.2 * np.sin(angle + 0.4)


def steps(angle: Array, rng: np.random.Generator) -> Array:
    """Return a train of steps, one a second, and sensor noise."""
    levels = np.repeat(rng.choice([-0.5, 0.0, 0.5], angle.size // 1000 + 1), 1000)
    return levels[: angle.size] + 0.005 * rng.standard_normal(angle.size)


NO_JOINT: dict[str, Callable[[Array, np.random.Generator], Array]] = {
    "torque unrelated to the motion": unrelated,
    "gravity compensation": gravity,
    "step train": steps,
}


def rows() -> Iterator[tuple[str, Callable[[int], Epoch], Scenario]]:
    """Yield each row's name, its epochs by number, and whose settings they are analysed with."""
    for one in JOINTS:
        yield one.name, lambda k, one=one: one.simulated(k, 1).epochs[0], one
    for name, joint in PRESENT:
        for said, subject in (("", {}), (", voluntary 0.2 N·m", {"voluntary_nm": 0.2})):
            one = scenario(name + said, joint=joint, subject=subject)
            yield one.name, lambda k, one=one: one.simulated(k, 1).epochs[0], one
    for name, torque in NO_JOINT.items():
        yield name, lambda k, torque=torque: other(k, torque), JOINTS[0]


def other(number: int, torque: Callable[[Array, np.random.Generator], Array]) -> Epoch:
    """Return an epoch of a relaxed joint with another torque."""
    epoch = JOINTS[0].simulated(number, 1).epochs[0]
    channels = dict(epoch.channels)
    at, angle = channels["torque_nm"].time_s, channels["angle_rad"]
    values = torque(np.interp(at, angle.time_s, angle.values), np.random.default_rng(number))
    channels["torque_nm"] = Channel("torque_nm", at, values)
    return replace(epoch, channels=channels)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--only", nargs="+", default=[""], help="rows whose name holds a word")
    parser.add_argument("--perturbation", action="store_true", help="with its column")
    options = parser.parse_args()
    print("| joint | none | J, B, K alone | " + " | ".join(KINDS.values()) + " | why none |")
    print("| --- |" + " ---: |" * (2 + len(KINDS)) + " --- |")
    for name, epoch_of, one in rows():
        if not any(name.startswith(word) or word in name.split(",")[0] for word in options.only):
            continue
        counts: Counter[str] = Counter()
        why: Counter[str] = Counter()
        for number in range(options.epochs):
            epoch = epoch_of(number)
            epoch = epoch if options.perturbation else measured_alone(epoch)
            recording = Recording((epoch,), (), one.analysed_with(), ())
            (found,) = fit_terms(recording, TERMS, compare=True).epochs
            chosen = found.models and found.models.compared.recommended
            if chosen is None:
                reason = found.models.compared.reason if found.models else found.problem
                counts["none"] += 1
                why[reason.split(": ", 1)[-1][:60]] += 1
                continue
            bases = {term.split("-")[0].rstrip("+") for term in chosen.terms}
            kinds = {kind for kind in KINDS if kind in chosen.terms or kind in bases}
            counts.update(kinds or {"alone"})
        shown = [100 * counts[key] / options.epochs for key in ("none", "alone", *KINDS)]
        reason = why.most_common(1)[0][0] if why else ""
        print(f"| {name} | " + " | ".join(f"{v:.0f}" for v in shown) + f" | {reason} |", flush=True)


if __name__ == "__main__":
    main()
