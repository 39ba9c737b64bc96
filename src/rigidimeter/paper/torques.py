"""Fig. 4b to 4d: measured, estimated and simulated torque of an OFF epoch, from the virtual study.

Estimated is J, B and K times the measured motion; simulated is the motion that the perturbation
alone causes in the closed loop, and its torque. All go through one band.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.dynamics import closed_loop_motion
from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.estimation import Signals, aligned, epoch_signals
from rigidimeter.estimation.bandlimited import zero_phase_band
from rigidimeter.paper.comparison_table import Picture, Row
from rigidimeter.paper.context import Workshop
from rigidimeter.paper.figures import traces
from rigidimeter.records import Channel
from rigidimeter.reporting.numbers import number
from rigidimeter.reporting.style import svg_text
from rigidimeter.settings import Settings

__all__ = ["ROWS"]

Array = NDArray[np.float64]

_WINDOW_S = (2.0, 12.0)


class _Torques(NamedTuple):
    """One OFF epoch: what was measured, what the fit makes of it, and what a simulation does."""

    measured: Signals
    simulated: Signals
    joint: JointDynamics
    start_s: float


def _torques(workshop: Workshop) -> _Torques:
    study, analysis = workshop.study, workshop.analysis
    settings = study.settings
    off = sorted(
        (f for f in analysis.fixed_inertia if f.condition == "OFF" and f.outcome.included),
        key=lambda f: f.vaf_percent,
    )
    fit = off[(len(off) - 1) // 2]
    joint = JointDynamics(fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad)
    named = (fit.source, fit.epoch)
    epoch = next(epoch for epoch in study.epochs if (epoch.source, epoch.label) == named)
    measured = epoch_signals(aligned(epoch, analysis.delays), "bandlimited", settings.estimation)
    perturbation = epoch.channels["perturbation_nm"]
    start_s = float(perturbation.time_s[0])
    return _Torques(measured, _simulated(settings, perturbation, measured, joint), joint, start_s)


def _simulated(
    settings: Settings, perturbation: Channel, measured: Signals, joint: JointDynamics
) -> Signals:
    """Return the motion, and the torque, that the perturbation alone causes in the closed loop."""
    rate_hz = settings.rig.tick_rate_hz
    motion = closed_loop_motion(perturbation.values, settings, joint)

    def there(values: Array) -> Array:
        filtered = zero_phase_band(values, rate_hz, measured.band_hz)
        return np.asarray(np.interp(measured.time_s, perturbation.time_s, filtered))

    angle, velocity = there(motion.angle_rad), there(motion.velocity_rad_s)
    acceleration = there(motion.acceleration_rad_s2)
    return replace(
        measured,
        torque_nm=joint.torque_nm(angle, velocity, acceleration),
        acceleration_rad_s2=acceleration,
        velocity_rad_s=velocity,
        angle_rad=angle,
    )


def _difference_percent(first: Array, second: Array) -> float:
    return 100.0 * float(np.std(first - second) / np.std(first))


def _figure_4(
    workshop: Workshop, row: str, figure: str, paper: str, part: str, caption: str
) -> Row:
    found = _torques(workshop)
    signals, simulated, joint = found.measured, found.simulated, found.joint
    time_s = signals.time_s - found.start_s  # the session has begun earlier
    inside = (time_s >= _WINDOW_S[0]) & (time_s <= _WINDOW_S[1])
    drawn: dict[str, Array] = {}
    text = ""
    if part == "torque":
        estimated = joint.torque_nm(
            signals.angle_rad, signals.velocity_rad_s, signals.acceleration_rad_s2
        )
        other = simulated.torque_nm
        drawn["measured"] = signals.torque_nm
        share = _difference_percent(signals.torque_nm, estimated)
        text = f"estimated misses measured by {number(share, 3)} % (SD), "
    else:
        factor, name = {
            "stiffness": (joint.stiffness_nm_rad, "angle_rad"),
            "damping": (joint.damping_nm_s_rad, "velocity_rad_s"),
        }[part]
        estimated = factor * getattr(signals, name)
        other = factor * getattr(simulated, name)
    share = _difference_percent(estimated, other)
    text += f"simulated misses estimated by {number(share, 3)} % (SD)"
    drawn |= {"estimated": estimated, "simulated": other}
    picture = traces(
        time_s[inside],
        {name: values[inside] for name, values in drawn.items()},
        float(np.max(np.abs(signals.torque_nm[inside]))),  # one scale for all three figures
        "OFF, virtual data",
    )
    return Row(
        id=row,
        source=f"{figure}, Sec. 3.5",
        paper=paper,
        ours=f"virtual OFF epoch of median fit (J {number(joint.inertia_kg_m2)}, "
        f"B {number(joint.damping_nm_s_rad)}, K {number(joint.stiffness_nm_rad)}): {text}",
        reading="Estimated: parameters times measured motion; simulated: the motion by integration "
        "of the perturbation alone; all in one band.",
        checks=(),
        unpublished="The recordings of the animal were not published; an epoch of the virtual "
        "study stands in.",
        pictures=(Picture(row, svg_text(picture), f"{caption} over ten seconds.", caption),),
        virtual=True,
    )  # fmt: skip


def figure_4b(workshop: Workshop) -> Row:
    """Make the row: measured, estimated and simulated torque."""
    return _figure_4(
        workshop, "fig-4b", "Fig. 4(b)", "the estimated torque describes the measured one well",
        "torque", "Fig. 4(b) from virtual data: measured, estimated and simulated torque",
    )  # fmt: skip


def figure_4c(workshop: Workshop) -> Row:
    """Make the row: the part of the stiffness."""
    return _figure_4(
        workshop, "fig-4c", "Fig. 4(c)",
        "stiffness part; estimated and simulated differ more than for the viscosity",
        "stiffness", "Fig. 4(c) from virtual data: the part of the stiffness, Kθ",
    )  # fmt: skip


def figure_4d(workshop: Workshop) -> Row:
    """Make the row: the part of the damping."""
    return _figure_4(
        workshop, "fig-4d", "Fig. 4(d)", "viscous part; estimated and simulated alike",
        "damping", "Fig. 4(d) from virtual data: the part of the damping, Bθ′",
    )  # fmt: skip


ROWS: Mapping[str, Callable[[Workshop], Row]] = {
    "fig-4b": figure_4b,
    "fig-4c": figure_4c,
    "fig-4d": figure_4d,
}
