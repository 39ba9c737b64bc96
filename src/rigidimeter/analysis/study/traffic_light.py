"""How far the data can be trusted: a traffic light, the epochs that are sound, the main finding.

An epoch is sound if it counts without a caution. What concerns all epochs together counts too, but
for checks that make no difference between conditions where two are compared.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from rigidimeter.analysis.study.conclusions import conclude
from rigidimeter.analysis.study.objections import ALIKE_IN_BOTH
from rigidimeter.analysis.study.results import StudyResult
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
        of a caution.
    doubt, doubt_epochs : str, int
        The finding of most epochs, and of how many: 0 if only of all of them together. Empty
        without a caution, or where a reason in `text` is no finding of epochs.
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
    included = [fit for fit in analysis.fits if fit.outcome.included]
    flagged = {(fit.source, fit.epoch) for fit in included if fit.cautions}
    carried = [
        (len({(fit.source, fit.epoch) for fit in group.fits} & counting), group)
        for group in analysis.findings
        if group.finding.level != "note"
    ]
    carried = [
        (epochs, group)
        for epochs, group in carried
        if epochs or not (result.other and group.finding.name in ALIKE_IN_BOTH)
    ]
    doubt, doubt_epochs, found = "", 0, None
    if carried:
        doubt_epochs, group = max(carried, key=lambda one: one[0])
        doubt, found = group.finding.name, group.finding
    concluded = conclude(result)
    unsupported = () if concluded is None else concluded.of("not supported")
    text = found.headline if found else unsupported[0].reason if unsupported else ""
    if result.left_out and not text:
        n_out = len({out.path for out in result.left_out})
        text = f"{n_out} of the study's recordings could not be used"
    impossible = any(fit.inertia_kg_m2 <= 0 for fit in included)
    if impossible:
        text, doubt = "J is not greater than zero in some epochs, which is impossible", ""
    share = len(counting - flagged) / len(recorded)
    level: Level = "good"
    if share < POOR_SHARE or impossible:
        level = "poor"
    elif share < GOOD_SHARE or (found and not doubt_epochs) or unsupported or result.left_out:
        level = "caution"
    return TrafficLight(
        level,
        len(recorded),
        len(counting - flagged),
        len(recorded - counting),
        len(flagged),
        doubt,
        doubt_epochs,
        text,
        found.words.remedy if found else "",
    )
