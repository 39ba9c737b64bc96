"""Everything that will be commanded under one set of settings, computed once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.experiment.band import BandCheck, check_band
from rigidimeter.experiment.demand import Demand, beyond_limits, demand, ideal_response
from rigidimeter.experiment.joint_bandwidth import Corners, corners
from rigidimeter.experiment.position_sinusoid import sinusoid
from rigidimeter.experiment.prbs import prbs_nm
from rigidimeter.experiment.session_order import Protocol, plan
from rigidimeter.records import readonly
from rigidimeter.settings import Settings

__all__ = ["FREE_ARM", "Overview", "overview"]

FREE_ARM = "free arm"
"""The name of the response of the arm with no subject in it."""


@dataclass(frozen=True)
class Overview:
    """What will be commanded, what it excites, and what it asks of the rig.

    Attributes
    ----------
    settings : Settings
        From which all of it follows.
    perturbation_nm : array, shape (n,)
        The PRBS, one value a tick.
    angle_rad, velocity_rad_s : array, shape (m,)
        The sinusoid, one value a tick.
    band : BandCheck
        Whether the PRBS covers the wanted band.
    bandwidth : Corners
        The bandwidth of the arm of App. A.
    protocol : Protocol
        The session.
    sinusoid_demand : Demand
        What the sinusoid asks of the rig.
    prbs_demand : mapping of str to Demand
        What the PRBS makes the arm do in the ideal loop: free, and with the median joint of each
        condition of the settings.
    warnings : tuple of str
        A sentence for each limit of the guard that a perturbation would pass.
    """

    settings: Settings
    perturbation_nm: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]
    band: BandCheck
    bandwidth: Corners
    protocol: Protocol
    sinusoid_demand: Demand
    prbs_demand: Mapping[str, Demand]
    warnings: tuple[str, ...]


def overview(settings: Settings) -> Overview:
    """Compute everything that will be commanded.

    Raises
    ------
    UserError
        If the PRBS never changes level within its duration.
    """
    rate_hz, guard = settings.rig.tick_rate_hz, settings.guard
    perturbation_nm = readonly(prbs_nm(settings.prbs, rate_hz))
    angle_rad, velocity_rad_s = map(readonly, sinusoid(settings.sinusoid, rate_hz))
    sinusoid_demand = demand(angle_rad, velocity_rad_s, rate_hz, guard)
    warnings = list(beyond_limits("the sinusoid", sinusoid_demand, guard))

    joints: dict[str, JointDynamics | None] = {FREE_ARM: None}
    for condition, subject in settings.subject.items():
        joints[f"subject {condition}"] = JointDynamics(
            subject.inertia_kg_m2, subject.damping_nm_s_rad, subject.stiffness_nm_rad
        )
    prbs_demand = {}
    for name, joint in joints.items():
        motion = ideal_response(perturbation_nm, settings.controller, joint, rate_hz)
        prbs_demand[name] = demand(*motion, rate_hz, guard)
        warnings += beyond_limits(f"the PRBS ({name}, ideal loop)", prbs_demand[name], guard)

    return Overview(
        settings=settings,
        perturbation_nm=perturbation_nm,
        angle_rad=angle_rad,
        velocity_rad_s=velocity_rad_s,
        band=check_band(settings.prbs, rate_hz),
        bandwidth=corners(),
        protocol=plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed),
        sinusoid_demand=sinusoid_demand,
        prbs_demand=prbs_demand,
        warnings=tuple(warnings),
    )
