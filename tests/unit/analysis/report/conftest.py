"""Epochs of a joint that obeys Eq. 3 exactly, and studies made of them by hand."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.recording import estimate
from rigidimeter.analysis.report import Shown
from rigidimeter.analysis.study import analysis_study, conclude_study
from rigidimeter.core.records import Analysis, Channel, Epoch, Fit, Motion, Notice, Outcome, Score
from rigidimeter.core.settings import Settings
from rigidimeter.model import JointDynamics
from rigidimeter.planning import prbs_levels

RATE_HZ = 250.0
OFF = JointDynamics(0.0045, 0.1368, 1.751)
DBS = JointDynamics(0.0045, 0.1150, 1.420)
INERTIA_C, DAMPING_C = 0.0458, 1.604


def channels(time_s: np.ndarray, **values: np.ndarray) -> dict[str, Channel]:
    return {name: Channel(name, time_s, samples) for name, samples in values.items()}


def driven(joint: JointDynamics) -> signal.StateSpace:
    """Return the joint in the admittance loop, from the perturbation to the angle."""
    inertia, damping = joint.inertia_kg_m2 + INERTIA_C, joint.damping_nm_s_rad + DAMPING_C
    return signal.lti([1.0], [inertia, damping, joint.stiffness_nm_rad]).to_ss()


def prbs_epoch(
    joint: JointDynamics, label: str, condition: str, source: str, rng: np.random.Generator
) -> Epoch:
    """Return the admittance loop's exact answer to random levels, with sensor noise."""
    time_s = 100.0 + np.arange(int(20 * RATE_HZ)) / RATE_HZ
    levels = np.random.default_rng(0).choice([-1.0, 1.0], size=400)
    perturbation = levels[np.minimum((20 * (time_s - 100)).astype(int), 399)]
    loop = driven(joint)
    _, _, states = signal.lsim(loop, perturbation, time_s - 100)
    velocity, angle = states[:, 0], states[:, 1] * loop.C[0, 1]
    velocity = velocity * loop.C[0, 1]
    torque = joint.torque_nm(angle, velocity, np.gradient(velocity, 1 / RATE_HZ))
    noise = 0.01 * rng.standard_normal(torque.size)
    return Epoch(
        source,
        label,
        channels(
            time_s,
            torque_nm=torque + noise,
            angle_rad=angle,
            velocity_rad_s=velocity,
            perturbation_nm=perturbation,
        ),
        condition,
        "prbs",
        excitation_hz=(0.15, 10.0),
    )


def periodic_epoch(
    joint: JointDynamics,
    label: str,
    condition: str,
    rng: np.random.Generator,
    first_chip: int = 0,
    noise_nm: float = 0.01,
) -> Epoch:
    """Return the loop's exact answer to three periods of a sequence that began earlier."""
    levels, per_chip, periods = prbs_levels(6), 25, 3
    held = np.repeat(np.roll(np.tile(levels, periods + 1), -first_chip), per_chip)
    time_s = np.arange(held.size) / RATE_HZ
    loop = driven(joint)
    _, angle, states = signal.lsim(loop, held, time_s, interp=False)
    velocity = states[:, 0] * loop.C[0, 1]
    acceleration = (states @ loop.A[0] + loop.B[0, 0] * held) * loop.C[0, 1]
    settled = slice(levels.size * per_chip, None)  # one period for the transient
    torque = joint.torque_nm(angle, velocity, acceleration)[settled]
    made = channels(
        time_s[settled],
        torque_nm=torque + noise_nm * rng.standard_normal(torque.size),
        angle_rad=angle[settled],
        velocity_rad_s=velocity[settled],
        perturbation_nm=held[settled],
    )
    return Epoch("/data/periodic.csv", label, made, condition, "prbs", excitation_hz=(0.15, 5.0))


def sinusoid_epoch(joint: JointDynamics, label: str, condition: str, source: str) -> Epoch:
    time_s = np.arange(int(12 * RATE_HZ)) / RATE_HZ
    angle, w = np.radians(20), 2 * np.pi
    theta, dot = angle * np.sin(w * time_s), angle * w * np.cos(w * time_s)
    torque = joint.torque_nm(theta, dot, -(w**2) * theta)
    return Epoch(
        source,
        label,
        channels(time_s, torque_nm=torque, angle_rad=theta, velocity_rad_s=dot),
        condition,
        "sinusoid",
        motion=Motion(1.0, 1.0, 10.0),
    )


def scaled(joint: JointDynamics, by: float) -> JointDynamics:
    return JointDynamics(
        joint.inertia_kg_m2 * by, joint.damping_nm_s_rad * by, joint.stiffness_nm_rad * by
    )


MakeStudy = Callable[..., Shown]


@pytest.fixture(scope="session")
def make_study() -> MakeStudy:
    """Return a function that makes what a page shows of epochs: all of it, or parts replaced."""

    def make(
        epochs: list[Epoch],
        analysis: Analysis | None = None,
        notices: tuple[Notice, ...] = (),
        **parts: object,
    ) -> Shown:
        settings = Settings()
        analysis = analysis or estimate(epochs, settings=settings)
        study = analysis_study(analysis, epochs=epochs, settings=settings)
        result = conclude_study(replace(study, notices=notices), resamples=199)
        facts = {"title": "A study", "provenance": {"program": "rigidimeter 0"}}
        return Shown(result, tuple(epochs), **{**facts, **parts})

    return make


@pytest.fixture(scope="session")
def epochs() -> list[Epoch]:
    """Return 5 + 5 perturbation epochs and 4 + 4 sinusoids, one of each kind ended badly."""
    rng = np.random.default_rng(7)
    made = []
    for condition, joint in (("OFF", OFF), ("DBS", DBS)):
        source = f"/data/a long way down/{condition.lower()}.csv"
        for i in range(5):
            by = float(rng.lognormal(0, 0.08))
            made.append(prbs_epoch(scaled(joint, by), f"p{i}", condition, source, rng))
        for i in range(4):
            by = float(rng.lognormal(0, 0.08))
            made.append(sinusoid_epoch(scaled(joint, by), f"s{i}", condition, source))
    touched = Outcome("excluded", "the arm touched the position limit")
    return [replace(made[0], excitation_hz=None, closed=touched), *made[1:]]


@pytest.fixture(scope="session")
def periodic_study(make_study: MakeStudy) -> Shown:
    """Return two epochs of each condition, each begun elsewhere in the sequence."""
    rng = np.random.default_rng(11)
    return make_study(
        [
            periodic_epoch(joint, f"{condition}{i}", condition, rng, first_chip=17 * i)
            for condition, joint in (("OFF", OFF), ("DBS", DBS))
            for i in range(2)
        ]
    )


@pytest.fixture(scope="session")
def study(epochs: list[Epoch], make_study: MakeStudy) -> Shown:
    return make_study(epochs, notices=(Notice("warning", "one column was empty"),))


def fit(label: str, condition: str, value: float, outcome: Outcome | None = None) -> Fit:
    """Return a fit whose intervals reach two standard errors either way."""
    estimate = np.array([0.0045, value, 10 * value])
    error = np.array([1e-4, 1e-3, 1e-2])
    return Fit(
        source="x.csv",
        epoch=label,
        condition=condition,
        method="bandlimited",
        outcome=outcome or Outcome(),
        value=estimate,
        se=error,
        low=estimate - 2 * error,
        high=estimate + 2 * error,
        bound=0.9 * error,
        r_squared=0.97,
        vaf_percent=97.0,
        condition_number=4.2,
        residual_sd_nm=0.02,
        n_samples=4501,
        band_hz=(0.15, 10.0),
    )


@pytest.fixture(scope="session")
def make_analysis() -> Callable[..., Analysis]:
    """Return a function that makes an analysis without recordings, any number of epochs long."""

    def make(
        counts: dict[str, int], outcome: Outcome | None = None, scores: bool = True
    ) -> Analysis:
        rng = np.random.default_rng(3)
        fits = tuple(
            fit(f"{i}", condition, float(rng.lognormal(-2, 0.2)), outcome)
            for condition, count in counts.items()
            for i in range(count)
        )
        if outcome is not None and outcome.kind == "failed":
            fits = tuple(Fit(f.source, f.epoch, f.condition, f.method, outcome) for f in fits)
        made = tuple(
            Score("x.csv", f"s{f.epoch}", f.condition, Outcome(), f.stiffness_nm_rad, 0.3, 8, 1.0)
            for f in fits
        )
        median = 0.0045 if outcome is None and fits else float("nan")
        return Analysis("bandlimited", fits, fits, median, made if scores else ())

    return make
