"""`fit_terms`: the torque of each epoch as a sum of named terms, from Python."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rigidimeter.analysis.estimation import Progress, candidates, parse_terms
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording.torque_models import ModelledEpoch, model_recording
from rigidimeter.core.errors import UserError
from rigidimeter.core.words import one_line, plural

if TYPE_CHECKING:
    import pandas as pd

USUAL = "inertia,damping,stiffness"
COMPARED = f"{USUAL},reflex,cubic,directional-damping,coulomb"


@dataclass(frozen=True)
class FittedTerms:
    """Models of the torque of each epoch.

    Attributes
    ----------
    epochs : tuple of ModelledEpoch
        Each with its models, or with the problem for which it has none.
    """

    epochs: tuple[ModelledEpoch, ...]

    @property
    def recommended(self) -> tuple[str, ...]:
        """For each epoch the terms of the model to use, comma-separated, or an empty text."""
        chosen = (
            e.models.compared.recommended if e.models is not None else None for e in self.epochs
        )
        return tuple(",".join(one.terms) if one is not None else "" for one in chosen)

    @property
    def problems(self) -> tuple[str, ...]:
        """For each epoch or model without a fit, why, in a sentence."""
        return tuple(
            f"{each.epoch.name}: {problem}"
            for each in self.epochs
            for problem in (*each.unfitted, each.problem)
            if problem
        )

    def table(self) -> pd.DataFrame:
        """Return one row for each parameter of each model of each epoch.

        `vaf_percent` is the share of the torque's variance that the model explains; where models
        are compared, `held_out_vaf_percent` is that in blocks that it was not fitted to.
        """
        import pandas as pd

        rows = [
            (
                modelled.epoch.label,
                modelled.epoch.condition,
                ",".join(row.terms),
                f"{one.term} {one.name}".strip(),
                one.value,
                one.standard_error,
                one.unit,
                row.fit.vaf_percent,
                row.held_out_vaf_percent,
            )
            for modelled in self.epochs
            for row in (modelled.models.compared.rows if modelled.models is not None else ())
            if row.fit is not None
            for one in row.fit.parameters
        ]
        columns = ["epoch", "condition", "model", "parameter", "value", "se", "unit"]
        return pd.DataFrame(rows, columns=[*columns, "vaf_percent", "held_out_vaf_percent"])

    def __repr__(self) -> str:
        """Return which model is recommended, or that each was asked for, as one line."""
        compared = any(each.compared for each in self.epochs)
        chosen = sorted({text or "no model" for text in self.recommended})
        return one_line(
            f"torque of {plural(len(self.epochs), 'epoch')} as a sum of terms",
            *self.problems,
            f"recommended: {' or '.join(chosen)}" if compared else "",
        )

    def _repr_html_(self) -> str:
        return str(self.table().to_html(index=False))


def _asked(terms: str | Sequence[str] | None, compare: bool) -> tuple[list[tuple[str, ...]], bool]:
    """Return the models that are asked for, and whether terms are added to the best of them."""
    texts = [terms] if isinstance(terms, str) else terms or [COMPARED if compare else USUAL]
    if not isinstance(texts, Sequence) or not all(isinstance(text, str) for text in texts):
        raise UserError(f"terms are a text such as '{USUAL}', or a list of them, not {terms!r}")
    named = [parse_terms(text) for text in texts]
    if len(named) > 1 and all(len(one) == 1 for one in named):
        raise UserError(f"terms: each text is a model of its own; say '{','.join(texts)}' for one")
    grow = compare and len(named) == 1
    return [*candidates(named[0])] if grow else named, grow


def fit_terms(
    recording: Recording,
    terms: str | Sequence[str] | None = None,
    *,
    compare: bool = False,
    high_hz: float | None = None,
    progress: Progress = lambda _: None,
) -> FittedTerms:
    """Fit the torque of each perturbed epoch as a sum of terms, and find the terms it needs.

    Each epoch passes the checks of `estimate` first.

    Parameters
    ----------
    recording : Recording
    terms : str or sequence of str, optional
        The terms of a model, comma-separated, such as ``"inertia,damping,stiffness,coulomb"``, or
        of several models, each a text of its own. Default: J, B and K; with `compare` also a
        reflex, cubic stiffness, damping of each direction, and friction.
    compare : bool
        Compare the models by what they predict of blocks that they were not fitted to, and
        recommend one. Of one model J, B and K alone are tried, and each further term.
    high_hz : float, optional
        Fit from 0 Hz up to here, in Hz, with the mean of the torque, which ``offset`` and
        ``coulomb`` need.
    progress : callable
        Called with the share of the epochs that was done since, 1 in all.

    Returns
    -------
    FittedTerms
        `table()` has every parameter with its standard error.

    Raises
    ------
    UserError
        If a term is unknown, every epoch is an imposed sinusoid, or no model can be fitted.

    Examples
    --------
    >>> import rigidimeter as rm
    >>> table = rm.fit_terms(rm.data("elbow"), "inertia,damping,stiffness").table()
    >>> round(float(table.query("parameter == 'stiffness'")["value"].iloc[0]), 1)
    1.8
    """
    if not isinstance(recording, Recording):
        raise UserError("fit_terms takes a Recording; read a path with rigidimeter.read")
    models, grow = _asked(terms, compare)
    found = FittedTerms(
        model_recording(
            recording, models, compare=compare, grow=grow, high_hz=high_hz, progress=progress
        )
    )
    if not compare and found.problems and found.table().empty:
        raise UserError(*found.problems)
    return found
