"""How far the data can be trusted: a traffic light, the epochs that are sound, the main finding.

An epoch is sound if it counts and no check casts doubt on it. What doubts all epochs together
counts too, but for checks that make no difference between conditions where two are compared.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from rigidimeter.analysis.study.conclusions import conclude
from rigidimeter.analysis.study.doubted_epochs import ALIKE_IN_BOTH, Doubt, doubts
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Fit, Score

Level = Literal["good", "caution", "poor"]

GOOD_SHARE, POOR_SHARE = 0.9, 0.5
"""At least the first share of epochs is sound in good data; less than the second in poor data."""


@dataclass(frozen=True)
class TrafficLight:
    """The quality of the data of a result.

    Attributes
    ----------
    level : {"good", "caution", "poor"}
    epochs, sound, excluded, doubted : int
        Epochs recorded; of them those that are sound, that do not count, and that count in spite
        of a doubt.
    doubt, doubt_epochs : str, int
        The check that flags most epochs, and how many it flags: 0 if only all of
        them together. Empty without a doubt, or where a reason in `text` is no check.
    text, remedy : str
        What was found, and what to do about it.
    """

    level: Level
    epochs: int
    sound: int
    excluded: int
    doubted: int
    doubt: str = ""
    doubt_epochs: int = 0
    text: str = ""
    remedy: str = ""

    def row(self) -> dict[str, Any]:
        """Return it as documents and tables have it."""
        return asdict(self)


def traffic_light(result: StudyResult) -> TrafficLight | None:
    """Return the quality of the data; None where no epochs were recorded, as in a table."""
    analysis = result.analysis
    estimates: tuple[Fit | Score, ...] = (*analysis.fits, *analysis.scores)
    recorded = {(epoch.source, epoch.label) for epoch in result.epochs}
    recorded |= {(one.source, one.epoch) for one in estimates}
    if not recorded:
        return None
    counting = {(one.source, one.epoch) for one in estimates if one.outcome.included}
    doubted = {
        (fit.source, fit.epoch) for fit in analysis.fits if fit.outcome.included and fit.cautions
    }
    found = [one for one in doubts(analysis) if not _harmless(one, result)]
    most_serious = found[0] if found else None
    finding = None if most_serious is None else _first(most_serious.check, result)
    concluded = conclude(result)
    unsupported = () if concluded is None else concluded.of("not supported")
    text = finding.headline if finding else unsupported[0].reason if unsupported else ""
    if result.left_out and not text:
        n_out = len({out.path for out in result.left_out})
        text = f"{n_out} of the study's recordings could not be used"
    impossible = any(fit.inertia_kg_m2 <= 0 for fit in analysis.fits if fit.outcome.included)
    if impossible:
        text = "J is not greater than zero in some epochs, which is impossible"
    share = len(counting - doubted) / len(recorded)
    together = most_serious is not None and not most_serious.epochs
    level: Level = "good"
    if share < POOR_SHARE or impossible:
        level = "poor"
    elif share < GOOD_SHARE or together or unsupported or result.left_out:
        level = "caution"
    return TrafficLight(
        level,
        len(recorded),
        len(counting - doubted),
        len(recorded - counting),
        len(doubted),
        "" if most_serious is None or impossible else most_serious.check,
        0 if most_serious is None else most_serious.epochs,
        text,
        finding.remedy if finding else "",
    )


def _harmless(doubt: Doubt, result: StudyResult) -> bool:
    return bool(result.other) and not doubt.epochs and doubt.check in ALIKE_IN_BOTH


def _first(check: str, result: StudyResult) -> Finding | None:
    fits = (*result.analysis.fits, *result.analysis.pooled)
    found = (finding for fit in fits if fit.outcome.included for finding in fit.findings)
    return next((one for one in found if one.name == check and one.level != "note"), None)
