"""Options that several commands share."""

from __future__ import annotations

from rigidimeter.cli.help_pages import HOW_TO_READ, READ, RUN, WRITE

SETTINGS = READ.option(
    "--settings FILE",
    "Settings in TOML. A value that the file does not give has its default; "
    "examples/settings/study.toml is an example.",
)
JSON = WRITE.option("--json FILE", "All results, as JSON.")
FULL = WRITE.flag("--full", "Show every table below the first screen.")
CSV = WRITE.option("--csv FILE", "The table, as CSV.")
NEW_SESSION = WRITE.option("--out DIR", "New folder for the session.", ...)
RIG = READ.option("--rig RIG.toml", "The rig file. Default: the virtual rig.")
PRIORITY = RUN.further(
    "--priority N", "Real-time priority (SCHED_FIFO) of the loop; 0 for none.", 80, min=0, max=99
)
CPU = RUN.further("--cpu N", "Processor of the loop. Default: the last one.")
NEW_STUDY = WRITE.option("--out DIR", "New folder for the study.", ...)
SEED = RUN.further("--seed N", "Seed of all random numbers. Default: that of the settings.")
STUDY_SEED = RUN.option("--seed N", "Seed of all random numbers.", 2023, min=0, max=2**31)
GROUP = HOW_TO_READ.further(
    "--group NAME",
    "Take the subjects of this group alone: column `group` of sessions.csv, or of the table.",
)

KEY = HOW_TO_READ.further(
    "--key FILE",
    "Blinding key of a study folder (columns code and condition), if it is stored elsewhere.",
)
