"""Torque models of the epochs of a recording: fits, comparison, and their JSON document."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rigidimeter.analysis.estimate_anew import (
    EpochModels,
    ModelRow,
    Progress,
    TermsFit,
    model_epochs,
    prepare,
)
from rigidimeter.analysis.reading import Recording
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Epoch

MODEL_SCHEMA = "rigidimeter.model/2"


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
    compare, grow, high_hz
        As for `model_epochs`.
    progress : callable
        Called with the share of the epochs that was done since, 1 in all.

    Raises
    ------
    UserError
        If every epoch is an imposed sinusoid.
    """
    recorded = prepare(recording.epochs, recording.settings)
    found = []
    for ready, models_of, problem, clock in model_epochs(
        recorded, models, compare=compare, grow=grow, high_hz=high_hz
    ):
        found.append(ModelledEpoch(ready.epoch, models_of, problem, compare, clock))
        progress(1.0 / len(recorded.perturbed))
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
