"""Options that say how a recording is read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ColumnOption = Annotated[
    list[str] | None,
    typer.Option(
        "--column",
        metavar="NAME=COLUMN",
        help="What the file calls a quantity, for example torque=Fz; torque_nm=Fz says that it "
        "is in N·m. Repeat as needed.",
    ),
]
UnitOption = Annotated[
    list[str] | None,
    typer.Option(
        "--unit",
        metavar="NAME=UNIT",
        help="The unit of a column, where the file does not state it, for example angle=deg or "
        "time=ms; repeat as needed.",
    ),
]
ScaleOption = Annotated[
    list[str] | None,
    typer.Option(
        "--scale",
        metavar="NAME=FACTOR",
        help='What a column is multiplied by, for example "torque=2.5 Nm/V", or "torque=0.25 '
        'm" for a force with a lever arm; repeat as needed.',
    ),
]
OffsetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--offset",
        metavar="NAME=VALUE",
        help='What a column reads at zero, for example "torque=0.1 V"; repeat as needed.',
    ),
]
SkipRowsOption = Annotated[
    int,
    typer.Option(
        "--skip-rows", metavar="N", min=0, help="Lines at the beginning of a text not to read."
    ),
]
NamesOption = Annotated[
    str | None,
    typer.Option(
        "--names",
        metavar="A,B,...",
        help="The names of the columns of a text that does not name them.",
    ),
]
TableOption = Annotated[
    str | None,
    typer.Option("--table", metavar="NAME", help="The sheet that is read, of a file with several."),
]
MappingOption = Annotated[
    Path | None,
    typer.Option(
        "--mapping",
        metavar="FILE",
        help="A mapping file, which says columns, units and the like for the files of one "
        "laboratory; `rigidimeter inspect` writes one.",
    ),
]
JoinOption = Annotated[
    bool,
    typer.Option(
        "--join", help="The inputs are one recording, such as torque and motion in two files."
    ),
]
ClockOffsetOption = Annotated[
    str | None,
    typer.Option(
        "--clock-offset",
        metavar="S|found",
        help="With --join: seconds to add to the clocks of the second and later inputs; found: "
        "estimated from torque and motion.",
    ),
]
RateHzOption = Annotated[
    float | None,
    typer.Option(
        "--rate-hz", metavar="HZ", help="Sampling rate of a file without a time_s column."
    ),
]
ReactionOption = Annotated[
    bool,
    typer.Option(
        "--reaction",
        help="The file holds the reaction torque of the joint, the negative of the torque that "
        "drives it.",
    ),
]
EpochLengthSOption = Annotated[
    float | None,
    typer.Option(
        "--epoch-length-s",
        metavar="S",
        help="Cut a file without an epoch column into epochs of this length.",
    ),
]
ConditionOption = Annotated[
    list[str] | None,
    typer.Option(
        "--condition",
        metavar="NAME",
        help="Condition of files without a condition column: once for all of them, or once "
        "for each input in their order.",
    ),
]
TaskOption = Annotated[
    str | None,
    typer.Option(
        "--task",
        metavar="prbs|sinusoid",
        help="Fit J, B and K (prbs) or score (sinusoid). Default: found from the motion.",
    ),
]
LeaveOutOption = Annotated[
    list[str] | None,
    typer.Option(
        "--leave-out",
        metavar='"[NAME=]START:STOP REASON"',
        help="Seconds on the recording's clock that no estimate uses, for example "
        '"12.3:14.0 cough"; NAME is a recording, where there are several. Repeat as needed.',
    ),
]
