"""What can be counted: cycles, minutes, epochs, and the ways in which one number is printed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.estimation import scoring_cycles
from rigidimeter.experiment import plan
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import AGREES, DIFFERS, Row, bounded, near, within_percent
from rigidimeter.paper.context import Workshop
from rigidimeter.paper.imposed import imposed_epoch
from rigidimeter.reporting.numbers import number
from rigidimeter.settings import BlockSettings

__all__ = ["ROWS", "cycles_counted"]

_CYCLES = 8
_DAYS = {"OFF": 9, "DBS": 4}
_EXAMINERS = 3


def cycles_counted(workshop: Workshop, motion_s: float) -> int:
    """Return how many cycles are scored when the 20 s epoch holds so much motion."""
    settings = workshop.settings
    sinusoid = settings.sinusoid.model_copy(update={"motion_s": motion_s})
    scores = settings.scores.model_copy(update={"cycles": 1000})  # as many as there are
    changed = settings.model_copy(update={"sinusoid": sinusoid, "scores": scores})
    return scoring_cycles(imposed_epoch(printed.FIG_6, changed), scores).n_cycles


def cycles_of_motion(workshop: Workshop) -> Row:
    """Make the row: 10 s of motion less two seconds hold eight cycles."""
    count = cycles_counted(workshop, 10.0)
    return Row(
        id="sec-2.3-cycles-motion",
        source="Sec. 2.3, Eq. 1 and 2",
        paper="10 s of movement at 1.0 Hz, first and last second discarded, eight cycles",
        ours=f"{count} cycles",
        reading="The robot moves for 10 s of the 20 s epoch; the seconds are those of the motion.",
        checks=(near("Cycles of 10 s of motion", "1", _CYCLES, count, 0.0),),
        because={AGREES: "10 s − 2 s at 1 Hz are the eight cycles of the text."},
    )


def cycles_of_epoch(workshop: Workshop) -> Row:
    """Make the row: 20 s of motion would hold eighteen."""
    count = cycles_counted(workshop, 20.0)
    return Row(
        id="sec-2.3-cycles-epoch",
        source="Sec. 2.3",
        paper='"20 s epochs", "the first and last second of each epoch were discarded", eight '
        "cycles",
        ours=f"{count} cycles",
        reading="Not this one: see sec-2.3-cycles-motion.",
        checks=(near("Cycles of 20 s of motion", "1", _CYCLES, count, 0.0),),
        because={DIFFERS: "An epoch of 20 s in motion less two seconds holds far more than eight."},
    )


def session_length(workshop: Workshop) -> Row:
    """Make the row: fifteen epochs with their rests."""
    settings = workshop.settings
    block = BlockSettings(task="sinusoid", condition="OFF", epochs=printed.EPOCHS_A_CONDITION)
    protocol = settings.protocol.model_copy(update={"blocks": [block]})
    total_min = plan(protocol, settings.prbs, settings.sinusoid, settings.seed).total_s / 60.0
    return Row(
        id="sec-2.3-duration",
        source="Sec. 2.3",
        paper="15 epochs of 20 s with 10 or 20 s of rest last around 10 min",
        ours=f"{number(total_min, 3)} min, rests drawn at random",
        reading="A condition at a time.",
        checks=(within_percent("15 epochs", "min", printed.SESSION_MIN, total_min, 25.0),),
        because={AGREES: "20 s of epoch and 15 s of rest on average, fifteen times."},
    )


def table_1(workshop: Workshop) -> Row:
    """Make the row: the counts against days, examiners and epochs a day."""
    ratings, sines = printed.COUNTS["ratings"], printed.COUNTS["sinusoid"]
    planned = {name: days * printed.EPOCHS_A_CONDITION for name, days in _DAYS.items()}
    made = workshop.counts
    listed = "; ".join(
        f"{task} {numbers['OFF']}/{numbers['DBS']}" for task, numbers in made.items()
    )
    return Row(
        id="table-1",
        source="Table 1",
        paper="mUPDRS 27 OFF, 12 DBS; impulse 92, 46; viscosity and stiffness 78, 23",
        ours=f"9 and 4 days times 3 examiners: {_EXAMINERS * _DAYS['OFF']} and "
        f"{_EXAMINERS * _DAYS['DBS']} ratings; 15 epochs a day would be {planned['OFF']} and "
        f"{planned['DBS']} sinusoids; our virtual study has {listed}",
        reading="One rating an examiner and day; fewer epochs were scored than 15 a day would "
        "give; work has the counts of the impulse.",
        checks=(
            near("Ratings OFF", "1", ratings["OFF"], _EXAMINERS * _DAYS["OFF"], 0.0),
            near("Ratings DBS", "1", ratings["DBS"], _EXAMINERS * _DAYS["DBS"], 0.0),
            bounded("Sinusoids OFF not scored", "1", planned["OFF"] - sines["OFF"], low=0.0),
            bounded("Sinusoids DBS not scored", "1", planned["DBS"] - sines["DBS"], low=0.0),
        ),
        because={AGREES: "The counts fit the days, the examiners and the epochs of the text."},
    )


def one_stiffness(workshop: Workshop) -> Row:
    """Make the row: the median stiffness is printed three ways."""
    sets: Mapping[str, JointDynamics] = {
        "Sec. 3.4": printed.SEC_34,
        "Sec. 3.5": printed.FIG_4,
        "Fig. 6": printed.FIG_6,
    }
    values = [joint.stiffness_nm_rad for joint in sets.values()]
    spread_percent = 100.0 * (max(values) / min(values) - 1.0)
    text = ", ".join(f"{joint.stiffness_nm_rad:.3f} ({place})" for place, joint in sets.items())
    return Row(
        id="k-printed",
        source="Sec. 3.4, Sec. 3.5, Fig. 6",
        paper=f"K estimated from the experiments: {text} N·m/rad",
        ours=f"largest over smallest +{number(spread_percent, 3)} %; 1.130 is 1.310 with two "
        "digits exchanged",
        reading="Each is used where it is printed: 1.751 in the closed loop, 1.130 in Fig. 6, "
        "1.310 in Fig. 4.",
        checks=(bounded("Spread of K", "%", spread_percent, high=0.5),),
        because={DIFFERS: "One median cannot have three values; J (0.0045, 0.0044) and B (0.1368, "
                 "0.1300) go with two of them."},
    )  # fmt: skip


ROWS: Mapping[str, Callable[[Workshop], Row]] = {
    "sec-2.3-cycles-motion": cycles_of_motion,
    "sec-2.3-cycles-epoch": cycles_of_epoch,
    "sec-2.3-duration": session_length,
    "table-1": table_1,
    "k-printed": one_stiffness,
}
