"""What a report shows: a result, and beside it what the result does not keep of the recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rigidimeter.analysis.estimation import Ready
from rigidimeter.core.records import Analysis, Epoch

if TYPE_CHECKING:
    from rigidimeter.analysis.study_anew import Study, StudyResult


@dataclass(frozen=True)
class Shown:
    """A result with the recordings that it is from.

    Attributes
    ----------
    result : StudyResult
    epochs : tuple of Epoch
        As they were recorded, in the order in which they were read; empty for columns of a table
        and for estimates alone.
    prepared : tuple of Ready
        The epochs as they were analysed, with what was made of them, for the figures; empty where
        they were not analysed here.
    title : str
        Of the page.
    provenance : mapping of str to str
        Software, settings and files.
    own_rig : bool
        Whether a session of this program was among what was analysed, so that the settings of the
        rig are those that it was recorded with.
    changes : tuple of str
        What is new since the last analysis of a study folder was kept, in sentences.
    """

    result: StudyResult
    epochs: tuple[Epoch, ...] = ()
    prepared: tuple[Ready, ...] = field(default=(), repr=False, compare=False)
    title: str = ""
    provenance: Mapping[str, str] = field(default_factory=dict)
    own_rig: bool = False
    changes: tuple[str, ...] = ()

    @property
    def study(self) -> Study:
        """The study that was concluded from."""
        return self.result.study

    @property
    def analysis(self) -> Analysis:
        """The estimates that were concluded from."""
        return self.result.study.analysis
