"""What a report shows: a result, and beside it what the result does not keep of the recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

from rigidimeter.analysis.estimation import Ready, Recorded, method_named
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording import provenance
from rigidimeter.analysis.study import (
    Loaded,
    Study,
    StudyResult,
    analysis_study,
    conclude_study,
    condition_names,
    prepare_study,
)
from rigidimeter.analysis.traces import ChannelFacts, Prepared, channel_facts, prepared_epochs
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Epoch


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

    @classmethod
    def of_study(
        cls, result: StudyResult, loaded: Loaded, prepared: Mapping[str, Recorded]
    ) -> Self:
        """Return what is concluded of a study folder beside its recordings.

        Parameters
        ----------
        result : StudyResult
        loaded : Loaded
            The folder, as it was read for this result.
        prepared : mapping of str to Recorded
            As `prepare_study`.
        """
        as_recorded = method_named(result.study.analysis.method).as_recorded
        ready = tuple(
            one for own in prepared.values() for one in own.analysed(as_recorded=as_recorded)
        )
        return cls(result, loaded.epochs, ready, own_rig=loaded.recordings.settings is not None)

    @classmethod
    def of_recording(cls, recording: Recording, analysis: Analysis, command: str = "") -> Self:
        """Return a recording with its first two conditions compared.

        Parameters
        ----------
        recording : Recording
        analysis : Analysis
            What was estimated from it.
        command : str
            By which it was read, for the provenance.
        """
        settings = recording.settings
        study = analysis_study(analysis, epochs=recording.epochs, settings=settings)
        return cls(
            conclude_study(replace(study, notices=recording.notices), resamples=0),
            recording.epochs,
            provenance=provenance(recording.paths, recording.digests, settings, command),
            own_rig=recording.own_rig,
        )

    @classmethod
    def of_result(cls, result: StudyResult) -> Self:
        """Return a result beside the recordings that it is from, which are read again.

        Raises
        ------
        UserError
            If they cannot be read, or are no longer what the result is from.
        """
        if result.study.folder_read is None:
            return cls(result)
        loaded = result.study.folder_read()
        before, now = result.study.digests, {**loaded.folder.digests, **loaded.recordings.digests}
        if changed := sorted(name for name in {*before, *now} if before.get(name) != now.get(name)):
            raise UserError(
                f"{loaded.folder.folder}: {changed[0]} has changed since the study was compared; "
                "compare it again, and report that"
            )
        return cls.of_study(result, loaded, prepare_study(loaded))

    @property
    def study(self) -> Study:
        """The study that was concluded from."""
        return self.result.study

    @property
    def analysis(self) -> Analysis:
        """The estimates that were concluded from."""
        return self.result.study.analysis

    @cached_property
    def as_analysed(self) -> Prepared:
        """The epochs as they were analysed, by source and label."""
        return prepared_epochs(self.epochs, self.analysis, self.study.settings, self.prepared)

    @cached_property
    def channels(self) -> tuple[tuple[ChannelFacts, ...], ...]:
        """What tables say of the channels of each epoch, in the order of the epochs."""
        return channel_facts(self.epochs)

    @property
    def condition_names(self) -> tuple[str, ...]:
        """The conditions of the result, and those of epochs from which nothing was estimated."""
        return condition_names(self.study, [epoch.condition for epoch in self.epochs])
