"""What an estimator is: one `Method` record, made in the estimator's own module."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from rigidimeter.analysis.estimation.prepared import PreparedEpoch, SignalsOf
from rigidimeter.core.records import Fit

Progress = Callable[[float], None]
"""Called with the amount of work that was done since the last call."""


class FitEpochs(Protocol):
    """The function of an estimator."""

    def __call__(
        self,
        epochs: Sequence[PreparedEpoch],
        inertia_kg_m2: float | None,
        progress: Progress,
        pooled: bool,
    ) -> tuple[list[Fit], list[Fit]]:
        """Fit every epoch, and all epochs of each condition together.

        Parameters
        ----------
        epochs : sequence of PreparedEpoch
            Each with its settings.
        inertia_kg_m2 : float or None
            Hold J at this value (Eq. 7).
        progress : callable
            The work of one epoch is 1.
        pooled : bool
            Whether the fits of all epochs together are wanted.

        Returns
        -------
        fits : list of Fit
            One for each epoch, in order; one that could not be fitted has failed, with the reason.
        pooled : list of Fit
            One for each condition with an epoch that counts, and with several one for all of them
            together, whose condition is empty; their `epoch` is ``pooled``. Empty if not wanted.
        """


@dataclass(frozen=True)
class Method:
    """An estimator of J, B and K.

    Parameters
    ----------
    name : str
        As `--method` takes it.
    title : str
        What it does, in a few words.
    needs : tuple of str
        The channels it needs besides torque and a measured motion. A method that needs
        `perturbation_nm` is taken for one that voluntary torque does not bias.
    methods_text : str
        How the estimates were made, for a methods section: completes "J, B and K were estimated".
    fit : FitEpochs
        The function.
    references : tuple of str
        Keys of `analysis.report.references` that the methods text cites.
    signals : callable, optional
        The signals that it fits, where these are not those of ``bandlimited``.
    intervals_text : str
        What the intervals hold for.
    pooled_text : str
        What the intervals of the pooled estimates hold for.
    by_noise : bool
        Whether each frequency counts by its noise, and what torque of the subject does to least
        squares by the loop is in the intervals.
    as_recorded : bool
        Fit the channels as they are, without correcting the delay of the torque.
    in_sensitivity : bool
        Whether every study is analysed by it, beside the method chosen.
    """

    name: str
    title: str
    needs: tuple[str, ...]
    methods_text: str
    fit: FitEpochs
    references: tuple[str, ...] = ()
    signals: SignalsOf | None = None
    intervals_text: str = "Intervals are those that the method gives"
    pooled_text: str = "Those of all epochs together are its own too"
    by_noise: bool = False
    as_recorded: bool = False
    in_sensitivity: bool = False

    @property
    def uses_perturbation(self) -> bool:
        """Whether the perturbation is the instrument, so that voluntary torque does not bias it."""
        return "perturbation_nm" in self.needs
