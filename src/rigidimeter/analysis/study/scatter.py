"""How much J, B and K of a study vary between epochs and between days, to plan the next one."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.statistics import SubjectEpochs, day_components
from rigidimeter.analysis.study.from_folder import Loaded
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import PARAMETERS, Analysis


class DayScatter(NamedTuple):
    """SDs of one measure, in % of its mean in the reference condition.

    Attributes
    ----------
    name : str
        Such as ``damping_nm_s_rad``.
    between_epochs_percent : float
        Of one day and condition, without the standard errors of the epochs.
    between_days_percent : float
        Of one condition.
    condition_in_day_percent : float
        What a day does to one of the conditions; NaN where no subject has two days with both.
    days_both : int
        Days with both conditions.
    epochs : int
    """

    name: str
    between_epochs_percent: float
    between_days_percent: float
    condition_in_day_percent: float
    days_both: int
    epochs: int


def day_scatter(loaded: Loaded, analysis: Analysis) -> tuple[DayScatter, ...]:
    """Return the scatter of J, B and K in the two conditions of a study, by its components.

    Parameters
    ----------
    loaded : Loaded
    analysis : Analysis
        Of it, with J, B and K of each epoch.

    Raises
    ------
    UserError
        If the study has one day, or one epoch a day, so that the SDs are unknown.
    """
    pair = loaded.names.pair
    fits = [fit for fit in analysis.fits if fit.outcome.included and fit.condition in pair]
    of = [fit for fit in fits if fit.condition == pair[0]] or fits
    found = []
    for k, parameter in enumerate(PARAMETERS):
        epochs: SubjectEpochs = {}
        for fit in fits:
            session = loaded.recordings.entries[fit.source]
            days = epochs.setdefault(session.subject, {})
            both = days.setdefault(session.day, ([], []))
            both[pair.index(fit.condition)].append(float(fit.value[k]))
        parts = day_components(epochs)
        for what, value in (("epochs", parts.within), ("days", parts.between_days)):
            if math.isnan(value):
                raise UserError(
                    f"{loaded.folder.folder}: how much {parameter.symbol} differs between {what} "
                    f"is unknown; it takes a condition with two {what} or more"
                    f"{' on one day' if what == 'epochs' else ''}"
                )
        errors = [fit.se[k] for fit in fits]
        measured = float(np.mean(np.square([e for e in errors if math.isfinite(e)] or [0.0])))
        percent = 100.0 / abs(float(np.mean([fit.value[k] for fit in of])))
        variances = max(parts.within - measured, 0.0), parts.between_days, parts.condition_in_day
        within, between, in_day = (percent * math.sqrt(variance) for variance in variances)
        scatter = within, between, in_day, parts.days_both, len(fits)
        found.append(DayScatter(parameter.name, *scatter))
    return tuple(found)
