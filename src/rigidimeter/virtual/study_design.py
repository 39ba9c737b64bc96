"""What a virtual study assumes: the subject, the days, the counts, the examiners.

The joint of one epoch is log-normal about the joint of its day, which is log-normal about the
median of its condition:

    ln B = ln B_condition + d_day + e_epoch,     d ~ N(0, s_d²),  e ~ N(0, s_e²),  s² = ln(1 + c²)

with a coefficient of variation c of its own for days and for epochs; likewise J and K. The offset
of a day is that of the subject and of the cuff on that day, so it is the same in both conditions.
B and K scatter independently: the paper says nothing of their correlation.

An examiner feels the joint of the day, not its name:

    felt = level + gain · ½ (ln B_day/B_0 + ln K_day/K_0) + bias_examiner + noise

rounded to the next step of the scale and kept within it; B_0 and K_0 are the medians of the first
condition.

Where the numbers come from. The joints are those of the default settings: OFF that of Sec. 3.4, DBS
13 % less viscous and 18 % less stiff, which is chosen, for the paper prints none. The scatter is
what `planning.days_needed` assumes, from Table 2. Chosen are the voluntary torque of a subject at
rest, and all of the examiners.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from rigidimeter.core.settings import Settings, SubjectSettings
from rigidimeter.planning import DAY_CV_PERCENT, EPOCH_CV_PERCENT

PAPER_RATES: Mapping[str, Any] = {
    "torque": {"rate_hz": 100.0},
    "motion": {"rate_hz": 50.0, "jitter_s": 0.005},
}
"""Sec. 2.2: torque at 100 samples/s, angle and velocity at 50 with sporadic jitter."""


@dataclass(frozen=True)
class ConditionDesign:
    """One condition: its joint, its days, and how much is recorded in it.

    Attributes
    ----------
    name, title : str
    damping_nm_s_rad, stiffness_nm_rad : float
        Medians over all days.
    days : tuple of int
        The days on which it is measured, from 1.
    prbs_epochs, sinusoid_epochs : int
        In all; spread over the days as evenly as whole numbers go.
    voluntary_sd_nm : float
        Of the subject's torque, 0.3 to 4 Hz. A subject at rest has 0.01 N·m (chosen): a hundredth
        of the perturbation, twice the noise of the sensor.
    frequency_hz, amplitude_ma, pulse_width_us : float or None
        Of the stimulation, None where it is off.
    electrodes : str
    wash_in_min : float or None
        From switching to the first epoch.
    """

    name: str
    title: str
    damping_nm_s_rad: float
    stiffness_nm_rad: float
    days: tuple[int, ...]
    prbs_epochs: int
    sinusoid_epochs: int
    voluntary_sd_nm: float = 0.01
    frequency_hz: float | None = None
    amplitude_ma: float | None = None
    pulse_width_us: float | None = None
    electrodes: str = ""
    wash_in_min: float | None = None


@dataclass(frozen=True)
class StudyDesign:
    """Everything that a virtual study assumes.

    Attributes
    ----------
    name, title : str
    subject : str
    conditions : tuple of ConditionDesign
        The first is the reference: differences are first − second.
    inertia_kg_m2 : float
        The same in all conditions: stimulation moves no mass (Sec. 2.4.4).
    day_inertia_cv_percent, day_damping_cv_percent, day_stiffness_cv_percent : float
        Between days. Of J: the cuff is put on anew, chosen. Of B and K: a third of the variance.
    epoch_inertia_cv_percent, epoch_damping_cv_percent, epoch_stiffness_cv_percent : float
        Between the epochs of one day: the other two thirds. Of J: posture, chosen.
    examiners : tuple of str
        Each rates every condition of every day once.
    examiner_sd, rating_noise_sd : float
        In points of the scale: how far examiners lie apart, and how well one agrees with
        himself. Chosen: less than the step of the scale, as trained examiners would.
    rating_level : float
        Felt at the median joint of the first condition, in points: above the middle of the scale,
        since the arm is rigid in OFF. Chosen.
    rating_gain : float
        Points for each unit of the logarithm: at 2.0 a joint twice as stiff and viscous is rated
        1.4 points higher. Chosen.
    rating_scale : tuple of float
        Lowest and highest score (Sec. 2.1).
    rating_step : float
    days_apart : int
        Calendar days from one day to the next: not consecutive (Sec. 2.5).
    first_date : str
        Of the virtual calendar.
    settings : mapping
        What differs from the default settings, the subject apart. The paper's sampling rates, and
        rests of 1 s instead of 10 or 20: nothing that matters happens in the rest of a subject
        who neither tires nor learns.
    """

    name: str
    title: str
    subject: str
    conditions: tuple[ConditionDesign, ...]
    inertia_kg_m2: float = SubjectSettings().inertia_kg_m2
    day_inertia_cv_percent: float = DAY_CV_PERCENT["inertia"]
    day_damping_cv_percent: float = DAY_CV_PERCENT["damping"]
    day_stiffness_cv_percent: float = DAY_CV_PERCENT["stiffness"]
    epoch_inertia_cv_percent: float = EPOCH_CV_PERCENT["inertia"]
    epoch_damping_cv_percent: float = EPOCH_CV_PERCENT["damping"]
    epoch_stiffness_cv_percent: float = EPOCH_CV_PERCENT["stiffness"]
    examiners: tuple[str, ...] = ("A", "B", "C")
    examiner_sd: float = 0.3
    rating_noise_sd: float = 0.45
    rating_level: float = 2.0
    rating_gain: float = 2.0
    rating_scale: tuple[float, float] = (0.0, 3.0)
    rating_step: float = 0.5
    days_apart: int = 3
    first_date: str = "2001-01-01"
    settings: Mapping[str, Any] = field(
        default_factory=lambda: {
            "rig": dict(PAPER_RATES),
            "protocol": {"rests_s": [1.0], "return_s": 1.0},
        }
    )


_SUBJECT = Settings().subject
_OFF = ConditionDesign(
    name="OFF",
    title="stimulation off",
    damping_nm_s_rad=_SUBJECT["OFF"].damping_nm_s_rad,
    stiffness_nm_rad=_SUBJECT["OFF"].stiffness_nm_rad,
    days=(1, 2, 3, 4, 5, 6, 7, 8, 9),
    prbs_epochs=78,
    sinusoid_epochs=92,
)
_DBS = ConditionDesign(
    name="DBS",
    title="stimulation on",
    damping_nm_s_rad=_SUBJECT["DBS"].damping_nm_s_rad,
    stiffness_nm_rad=_SUBJECT["DBS"].stiffness_nm_rad,
    days=(2, 4, 6, 8),
    prbs_epochs=23,
    sinusoid_epochs=46,
    frequency_hz=130.0,
    amplitude_ma=0.32,
    pulse_width_us=60.0,
    electrodes="bipolar",
    wash_in_min=15.0,
)
_SAME = replace(
    _DBS, damping_nm_s_rad=_OFF.damping_nm_s_rad, stiffness_nm_rad=_OFF.stiffness_nm_rad
)

PAPER = StudyDesign("paper", "A virtual study of the paper's design", "V1", (_OFF, _DBS))
"""Sec. 2.5 and Table 1: OFF on each of nine days, DBS on four of them, before OFF or after it."""

NULL = replace(
    PAPER, name="null", title="A virtual study without any difference", conditions=(_OFF, _SAME)
)
"""The same design and sizes; DBS does nothing."""

PUSHING = replace(
    PAPER,
    name="pushing",
    title="A virtual study in which the subject pushes in one condition",
    conditions=(_OFF, replace(_SAME, voluntary_sd_nm=0.2)),
)
"""Equal joints, but in DBS the subject pushes with a fifth of the perturbation, which least squares
takes for a softer joint."""

DESIGNS: Mapping[str, StudyDesign] = {design.name: design for design in (PAPER, PUSHING, NULL)}
"""By name."""


SHORT_EPOCH_S = 10.0
"""A joint scatters far more between epochs than 10 s of it leave unknown, so more epochs of half
the length show more; the sinusoid still has its eight cycles."""


def short_design(n_days: int, prbs_epochs: int, sinusoid_epochs: int) -> StudyDesign:
    """Return a study of short epochs, both conditions each day, at the default sampling rates.

    Parameters
    ----------
    n_days : int
    prbs_epochs, sinusoid_epochs : int
        On each day in each condition.
    """
    days = tuple(range(1, n_days + 1))
    conditions = tuple(
        replace(
            condition,
            days=days,
            prbs_epochs=len(days) * prbs_epochs,
            sinusoid_epochs=len(days) * sinusoid_epochs,
        )
        for condition in PAPER.conditions
    )
    return replace(
        PAPER,
        name="short epochs",
        title="A virtual study of elbow rigidity",
        conditions=conditions,
        settings={
            "protocol": PAPER.settings["protocol"],
            "prbs": {"duration_s": SHORT_EPOCH_S},
            "sinusoid": {"duration_s": SHORT_EPOCH_S},
        },
    )
