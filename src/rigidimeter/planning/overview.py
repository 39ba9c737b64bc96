"""Everything that will be commanded under one set of settings, and what will come of it.

`design` computes it once: the perturbations and their band, the session, what the arm will do, the
stability of the loop, the standard errors to expect and, where asked for, the days needed, a
better PRBS and a multisine. `rigidimeter design` prints what it returns.
"""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import rigidimeter
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import PARAMETERS, readonly
from rigidimeter.core.session import Protocol
from rigidimeter.core.settings import Settings, settings_from
from rigidimeter.core.study_files import PrimaryTable, primary_named
from rigidimeter.core.words import html_table, one_line, plural
from rigidimeter.model import JointDynamics, Stability, loop_stability, median_joint
from rigidimeter.planning.assumed_scatter import Scatter
from rigidimeter.planning.days_needed import (
    Detection,
    WantedDifference,
    detections,
    planned_epochs,
)
from rigidimeter.planning.dose import dose_objection
from rigidimeter.planning.joint_bandwidth import APPENDIX_A, Corners, Forearm, corners
from rigidimeter.planning.motion_demand import (
    Demand,
    beyond_limits,
    demand,
    ideal_response,
    too_few_cycles,
)
from rigidimeter.planning.multisine import MultisineComparison, compare_multisine
from rigidimeter.planning.perturbation_band import BandCheck, check_band
from rigidimeter.planning.perturbations import plan, prbs_nm, sinusoid
from rigidimeter.planning.precision import PARAMETER_NAMES, PredictedPrecision, predicted_precision
from rigidimeter.planning.search import Candidate, assess, check_criterion, optimise

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_METHODS = ("bound", "iv", "least_squares")


@dataclass(frozen=True)
class Design:
    """What will be commanded, what it asks of the rig, and what it will tell.

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
    forearm : Forearm or None
        Of that arm, if it is not the paper's.
    protocol : Protocol
        The session.
    planned_epochs : mapping of str to int
        Epochs of the PRBS in it, by condition.
    sinusoid_demand : Demand
        What the sinusoid asks of the rig.
    prbs_demand : mapping of str to Demand
        What the PRBS makes the arm do in the ideal loop: free, and with the median joint of each
        condition of the settings.
    stability : Stability
        Of the loop, with the joint of each condition and the worst joint around it.
    precision : mapping of str to PredictedPrecision
        Standard errors of one epoch, by condition.
    remarks : tuple of str
        For each condition without an entry in `precision`, why it has none.
    warnings : tuple of str
        A sentence for each limit of the guard that a perturbation would pass, and for a sinusoid
        too short for the cycles to be scored; those on stability are in `stability`.
    detections : tuple of Detection
        Days, epochs a day and subjects needed for each difference that was asked for.
    criterion : str or None
        Of the search for a better PRBS, if there was one.
    present : Candidate or None
        The settings' own PRBS by that criterion.
    ranked : tuple of Candidate or None
        The sequences of the search, best first.
    multisine : MultisineComparison or None
    """

    settings: Settings
    perturbation_nm: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]
    band: BandCheck
    bandwidth: Corners
    protocol: Protocol
    planned_epochs: Mapping[str, int]
    sinusoid_demand: Demand
    prbs_demand: Mapping[str, Demand]
    stability: Stability
    precision: Mapping[str, PredictedPrecision]
    remarks: tuple[str, ...]
    warnings: tuple[str, ...]
    detections: tuple[Detection, ...] = ()
    criterion: str | None = None
    present: Candidate | None = None
    ranked: tuple[Candidate, ...] | None = None
    multisine: MultisineComparison | None = None
    forearm: Forearm | None = None

    def table(self) -> pd.DataFrame:
        """Return the predicted standard errors, one row a condition and method."""
        import pandas as pd

        rows = [
            (condition, method, *getattr(found, method).free)
            for condition, found in self.precision.items()
            for method in _METHODS
        ]
        columns = ["condition", "method", *(f"{name}_se" for name in PARAMETER_NAMES)]
        return pd.DataFrame(rows, columns=columns).set_index(["condition", "method"])

    def days(self) -> pd.DataFrame:
        """Return the days and subjects needed, one row a difference and number of epochs a day.

        A number above 1000 is missing.
        """
        import pandas as pd

        rows = [
            (found.wanted.parameter, found.difference, each.epochs[0], *counts)
            for found in self.detections
            for each in found.needed
            for counts in [(each.days, each.days_alone, each.subjects)]
        ]
        of = ["parameter", "difference", "epochs_a_day"]
        needed = ["days_needed", "days_needed_alone", "subjects_needed"]
        return pd.DataFrame(rows, columns=[*of, *needed]).set_index(of).astype("Int64")

    def plot(self, *, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
        """Draw the perturbation, its first seconds and complete, and its power spectrum.

        Parameters
        ----------
        axes : three matplotlib Axes, optional
            To draw on; without them a new figure is made.

        Returns
        -------
        array of matplotlib Axes, shape (3,)
        """
        return rigidimeter.plot(self, axes=axes)

    def __repr__(self) -> str:
        """Return the perturbation and what one epoch will tell, as one line."""
        prbs, stable = self.settings.prbs, all(m.stable for m in self.stability.conditions.values())
        warned = len(self.warnings) + len(self.stability.warnings)
        errors = [
            f"{condition} standard errors of one epoch: "
            + ", ".join(
                f"{p.symbol} {se:.2g} {p.unit}"
                for p, se in zip(PARAMETERS, found.iv.free, strict=True)
            )
            for condition, found in self.precision.items()
        ]
        return one_line(
            f"PRBS of {2**prbs.register_bits - 1} chips at {prbs.clock_hz:g} Hz, "
            f"{prbs.amplitude_nm:g} N·m, {prbs.duration_s:g} s",
            "" if stable else "the loop is unstable",
            *errors,
            plural(warned, "warning") if warned else "",
        )

    def _repr_html_(self) -> str:
        sentences = [*self.warnings, *self.stability.warnings, *self.remarks]
        heading = ["condition", "method", *(f"{p.symbol}, {p.unit}" for p in PARAMETERS)]
        rows = [
            [condition, method, *(f"{se:.2g}" for se in getattr(found, method).free)]
            for condition, found in self.precision.items()
            for method in _METHODS
        ]
        table = f"<p>Standard errors of one epoch</p>{html_table(heading, rows)}"
        if self.detections:
            table += str(self.days().to_html())
        return table + "".join(f"<p>{html.escape(sentence)}</p>" for sentence in sentences)


def design(
    settings: Settings | Path | str | Mapping[str, Any] | None = None,
    *,
    differences: Sequence[str] = (),
    primary: PrimaryTable | str | None = None,
    rule: str = "holm",
    power: float = 0.8,
    alpha: float = 0.05,
    scatter: Mapping[str, Scatter] | None = None,
    search: str | None = None,
    with_multisine: bool = False,
    forearm: Forearm | None = None,
    progress: Callable[[float], None] = lambda _: None,
    **changes: Any,
) -> Design:
    """Compute what will be commanded and what will come of it.

    Where the loop is unstable with the joint of a condition, that condition has no standard errors,
    and there is no search, multisine or number of days.

    Parameters
    ----------
    settings : Settings, path, mapping or None
        None stands for the defaults.
    differences : sequence of str
        Differences for which to find the days and epochs needed, such as ``"damping=20%"``.
    primary : str or PrimaryTable, optional
        Primary measures of the study, such as ``"stiffness,damping"``, which is the default.
    rule : {"holm", "sequence"}
        How they are tested together.
    power, alpha : float
        The chance to show them by the test by days, and the level of all primary measures.
    scatter : mapping of str to Scatter, optional
        How much inertia, damping and stiffness vary, by name; without it what is assumed.
    search : {"minimax", "A", "D"}, optional
        Search for a better PRBS by this criterion.
    with_multisine : bool
        Compare with a multisine.
    forearm : Forearm, optional
        For the bandwidth of App. A; without it, that of the arm as printed.
    progress : callable
        Called with the share of the search that was done since, 1 in all.
    **changes
        Tables of the settings with values that differ, such as ``prbs={"clock_hz": 10.0}``.

    Raises
    ------
    UserError
        If a value is out of range, or the PRBS never changes level within its duration.

    Examples
    --------
    >>> import rigidimeter as rm
    >>> found = rm.design(prbs={"amplitude_nm": 0.5}, differences=["stiffness=20%"])
    >>> all(condition.stable for condition in found.stability.conditions.values())
    True
    """
    chosen = settings_from(settings, **changes)
    wanted = [WantedDifference.parse(text) for text in differences]
    family = primary_named(primary, rule) if isinstance(primary, str) else primary
    if search is not None:
        check_criterion(search)
    rate_hz, guard = chosen.rig.tick_rate_hz, chosen.guard
    perturbation_nm = readonly(prbs_nm(chosen.prbs, rate_hz))
    angle_rad, velocity_rad_s = map(readonly, sinusoid(chosen.sinusoid, rate_hz))
    sinusoid_demand = demand(angle_rad, velocity_rad_s, rate_hz, guard)
    warnings = [*beyond_limits("the sinusoid", sinusoid_demand, guard), *too_few_cycles(chosen)]

    protocol = plan(chosen.protocol, chosen.prbs, chosen.sinusoid, chosen.seed)
    if too_much := dose_objection(chosen.dose, protocol):
        warnings.append(too_much)

    joints: dict[str, JointDynamics | None] = {"free arm": None}
    for condition, subject in chosen.subject.items():
        joints[f"subject {condition}"] = median_joint(subject)
    prbs_demand = {}
    for name, joint in joints.items():
        motion = ideal_response(perturbation_nm, chosen.controller, joint, rate_hz)
        prbs_demand[name] = demand(*motion, rate_hz, guard)
        warnings += beyond_limits(f"the PRBS ({name}, ideal loop)", prbs_demand[name], guard)

    stability = loop_stability(chosen)
    stable = all(margins.stable for margins in stability.conditions.values())
    precision, remarks = _precision(chosen, perturbation_nm, stability)
    searched = search is not None and stable
    # Before the search, which takes long: what it cannot be made of is refused at once.
    multisine = None
    if with_multisine and stable and precision:
        multisine = compare_multisine(chosen, perturbation_nm, precision)
    return Design(
        settings=chosen,
        perturbation_nm=perturbation_nm,
        angle_rad=angle_rad,
        velocity_rad_s=velocity_rad_s,
        band=check_band(chosen.prbs, rate_hz),
        bandwidth=corners(forearm.arm() if forearm else APPENDIX_A),
        protocol=protocol,
        planned_epochs=planned_epochs(chosen),
        sinusoid_demand=sinusoid_demand,
        prbs_demand=prbs_demand,
        stability=stability,
        precision=precision,
        remarks=remarks,
        warnings=tuple(warnings),
        detections=detections(
            chosen,
            perturbation_nm,
            wanted if stable else (),
            primary=family,
            scatter=scatter,
            power=power,
            alpha=alpha,
        ),
        criterion=search,
        present=assess(chosen, search) if searched and search else None,
        ranked=optimise(chosen, search, progress) if searched and search else None,
        multisine=multisine,
        forearm=forearm,
    )


def _precision(
    settings: Settings, perturbation_nm: NDArray[np.float64], stability: Stability
) -> tuple[dict[str, PredictedPrecision], tuple[str, ...]]:
    """Return the precision of each condition, or a remark why there is none."""
    precision, remarks = {}, []
    for name, subject in settings.subject.items():
        if not stability.conditions[name].stable:
            remarks.append(f"subject {name}: no standard errors, since the loop is unstable")
            continue
        try:
            precision[name] = predicted_precision(perturbation_nm, settings, subject)
        except UserError as obstacle:
            remarks.append(f"subject {name}: no standard errors, since {obstacle}")
    return precision, tuple(remarks)
