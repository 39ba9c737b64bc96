"""Torque models of the epochs of a recording: fits, comparison, and their JSON document."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from rigidimeter.analysis.estimation import (
    Comparison,
    ModelRow,
    Progress,
    TermsFit,
    better_clock,
    compare_models,
    estimate_recorded,
    fit_models,
    from_zero,
    observations_of,
    prepare,
    refusal,
)
from rigidimeter.analysis.reading import Recording
from rigidimeter.core.errors import UserError
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Epoch

MODEL_SCHEMA = "rigidimeter.model/2"


class EpochModels(NamedTuple):
    """The models of one epoch, the band they were fitted in, and what the checks found."""

    band_hz: tuple[float, float]
    compared: Comparison
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class ModelledEpoch:
    """An epoch and its models.

    Attributes
    ----------
    epoch : Epoch
    models : EpochModels or None
        None where the epoch cannot be used.
    problem : str
        Why it cannot be used.
    compared : bool
        Whether the models were compared, or each was asked for by its terms.
    clock : str
        Where the torque is taken as recorded though J, B and K alone would move it, why.
    """

    epoch: Epoch
    models: EpochModels | None
    problem: str
    compared: bool
    clock: str = ""

    @property
    def unfitted(self) -> tuple[str, ...]:
        """For each model that could not be fitted, why."""
        rows = self.models.compared.rows if self.models is not None else ()
        return tuple(row.problem for row in rows if row.fit is None)

    @property
    def failed(self) -> bool:
        """Whether no model is recommended, or not everything asked for by its terms was fitted."""
        if self.models is None:
            return True
        return self.models.compared.recommended is None if self.compared else bool(self.unfitted)


def model_recording(
    recording: Recording,
    models: Sequence[Sequence[str]],
    *,
    compare: bool = False,
    grow: bool = False,
    high_hz: float | None = None,
    progress: Progress = lambda _: None,
) -> tuple[ModelledEpoch, ...]:
    """Fit models to each perturbed epoch of a recording, or compare them.

    Parameters
    ----------
    recording : Recording
    models : sequence of sequences of str
        The terms of each.
    compare : bool
        Let each model predict what it has not seen, and recommend one.
    grow : bool
        As for `compare_models`.
    high_hz : float, optional
        The upper edge of a band that begins at 0 Hz, instead of the band of the settings.
    progress : callable
        Called with the share of the epochs that was done since, 1 in all.

    Raises
    ------
    UserError
        If every epoch is an imposed sinusoid.
    """
    settings = recording.settings
    if high_hz is not None:
        settings = from_zero(settings, high_hz)
    recorded = prepare(recording.epochs, recording.settings)
    fits = estimate_recorded(recorded).fits
    moved = recorded.analysed(as_recorded=False)
    found = []
    for own, ready, fit in zip(recorded.perturbed, moved, fits, strict=False):
        progress(1.0 / len(fits))
        try:
            seen = observations_of([ready._replace(settings=settings)])
            clock = ""
            if ready is not own:
                plain = observations_of([own._replace(settings=settings)])
                stamps_s = [o.epoch.channels["torque_nm"].time_s[0] for o in (own, ready)]
                delay_s = float(stamps_s[0] - stamps_s[1])
                better, clock = better_clock(seen, plain, delay_s, models)
                seen = list(better)
            if compare:
                compared = compare_models(seen, models, grow=grow, refused=refusal(fit))
            else:
                compared = fit_models(seen, models)
        except ValueError as error:
            found.append(ModelledEpoch(ready.epoch, None, str(error), compare))
            continue
        low_hz, upper_hz = seen[0].grid.band_hz
        band_hz = (low_hz if high_hz is None else 0.0, upper_hz)
        of_epoch = EpochModels(band_hz, compared, fit.findings)
        found.append(ModelledEpoch(ready.epoch, of_epoch, "", compare, clock))
    if not found:
        raise UserError("every epoch is an imposed sinusoid; a model needs a perturbed one")
    return tuple(found)


def model_document(found: Sequence[ModelledEpoch]) -> dict[str, Any]:
    """Return all models as one document, units in the names."""
    return {
        "schema": MODEL_SCHEMA,
        "compared": any(each.compared for each in found),
        "epochs": [_epoch_values(each) for each in found],
    }


def _epoch_values(found: ModelledEpoch) -> dict[str, Any]:
    epoch = found.epoch
    values: dict[str, Any] = {
        "source": epoch.source,
        "epoch": epoch.label,
        "condition": epoch.condition,
    }
    if found.models is None:
        return values | {"outcome": "failed", "reason": found.problem, "models": []}
    compared = found.models.compared
    values |= {
        "outcome": epoch.closed.kind,
        "reason": epoch.closed.reason,
        "band_hz": list(found.models.band_hz),
        "clock": found.clock,
        "findings": [finding.row() for finding in found.models.findings],
    }
    if found.compared:
        chosen = compared.recommended
        values |= {"recommended": chosen and list(chosen.terms), "why": compared.reason}
    values["models"] = [_row_values(row) for row in compared.rows]
    return values


def _row_values(row: ModelRow) -> dict[str, Any]:
    low, high = row.held_out[1:] if row.held_out is not None else (math.nan, math.nan)
    return {
        "terms": list(row.terms),
        "problem": row.problem,
        "held_out_vaf_percent": row.held_out_vaf_percent,
        "held_out_vaf_low_percent": low,
        "held_out_vaf_high_percent": high,
        "beyond_linear": [vars(one) for one in row.beyond],
        **(_fit_values(row.fit) if row.fit is not None else {}),
    }


def _fit_values(fit: TermsFit) -> dict[str, Any]:
    return {
        "parameters": [vars(one) for one in fit.parameters],
        "n_parameters": fit.n_parameters,
        "vaf_percent": fit.vaf_percent,
        "aic": fit.aic,
        "bic": fit.bic,
        "independent_samples": fit.independent_samples,
        "condition_number": fit.condition_number,
        "ljung_box_p": fit.test.ljung_box_p,
        "input_correlation": fit.test.input_correlation,
        "input_p": fit.test.input_p,
        "remarks": list(fit.remarks),
    }
