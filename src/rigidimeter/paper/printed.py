"""The numbers the paper prints, each with its place; nothing here is computed.

"Quantifying Viscous Damping and Stiffness in Parkinsonism Using Data-Driven Model Estimation and
Admittance Control". Where it prints one quantity in several ways, all of them are here.
"""

from __future__ import annotations

from typing import NamedTuple

from rigidimeter.model import JointDynamics

CONTROLLER_INERTIA, CONTROLLER_DAMPING = 0.0008, 0.028
"""J_c and B_c: per degree in Sec. 2.4.2, per radian in App. A."""

POSITION_SD_DEG = 4.0
"""Sec. 2.4.3: "approximately 4 deg for each perturbation epoch"."""

EXCITED_HZ = (0.15, 10.0)
"""Sec. 2.4.3 and Fig. 3(b)."""

BANDWIDTH_HZ = 3.5
"""Sec. 2.4.3: the worst-case cutoff."""

APP_A_FOREARM_INERTIA = 8.6625e-4
APP_A_INERTIA_TOTAL = 0.0052
APP_A_ELBOW_DAMPING = 0.06
APP_A_CONTROLLER_DAMPING = 0.028
APP_A_DAMPING_TOTAL = 0.0088
"""App. A: inertia in kg·m², damping in N·m·s/rad; more of it in `planning.joint_bandwidth`."""

EQUATION_8 = JointDynamics(0.0026, 0.044, 0.75)
"""App. A: "the transfer function with the largest bandwidth"."""

SEC_34 = JointDynamics(0.0045, 0.1368, 1.751)
"""Sec. 3.4: the joint of the simulations."""

SEC_34_RUNS = 100
"""Sec. 3.4: simulations."""

SEC_34_MEAN = (-1.9e-7, -2.6e-7, -1.9e-7)
"""Sec. 3.4, of 100 simulations: mean error of J, B and K."""

SEC_34_SD = (9.6e-7, 1.05e-6, 1.4e-6)
"""Sec. 3.4, of 100 simulations: standard deviation of the errors of J, B and K."""

FIG_4 = JointDynamics(0.0044, 0.1300, 1.310)
"""Sec. 3.5, "median values"."""

FIG_6 = JointDynamics(0.0044, 0.1300, 1.130)
"""Caption of Fig. 6, "the median estimates"."""

EPOCHS_A_CONDITION, SESSION_MIN = 15, 10.0
"""Sec. 2.3: epochs of a condition, and how long they last."""

WASH_OUT_MIN = 15.0
"""Sec. 2.5: from switching DBS off to the measurements in OFF."""

TABLE_1 = {
    "ratings": {"OFF": 27, "DBS": 12},
    "sinusoid": {"OFF": 92, "DBS": 46},
    "prbs": {"OFF": 78, "DBS": 23},
}
"""Table 1."""


class Measured(NamedTuple):
    """A line of Table 2, with what Table 1 counts of it and the p-value printed elsewhere."""

    title: str
    counted: str
    p_table: float
    r: float
    p_text: float
    place: str

    @property
    def n(self) -> int:
        """How many values were compared."""
        return sum(TABLE_1[self.counted].values())


MEASURED = {
    "mupdrs": Measured("Corrected mUPDRS score", "ratings", 0.04, 0.18, 0.020, "Sec. 3.1"),
    "impulse": Measured("Angular impulse score", "sinusoid", 4.3e-4, 0.30, 4.3e-4, "Sec. 3.3"),
    "work": Measured("Work score", "sinusoid", 2.8e-4, 0.31, 5.6e-4, "Sec. 3.3"),
    "viscosity": Measured("Viscosity", "prbs", 4.0e-4, 0.35, 5.0e-4, "Sec. 3.5 and Fig. 8"),
    "stiffness": Measured("Stiffness", "prbs", 1.8e-3, 0.37, 1.8e-4, "Sec. 3.5 and Fig. 8"),
}
