"""An empty study folder: study.toml and its tables, with comments and no rows."""

from __future__ import annotations

import json
from pathlib import Path

from rigidimeter.documents import write_text
from rigidimeter.errors import UserError, refused
from rigidimeter.recording.study_folder import TABLE_COLUMNS
from rigidimeter.recording.study_toml import STUDY_FILE

SKELETON = """\
schema = "rigidimeter.study/1"
title = {title}

# Differences are reference - other.
reference = "OFF"
other = "DBS"

# The tables, below this folder. Only that of the sessions must exist.
sessions = "sessions.csv"       # path,subject,day,condition,part,note
ratings = "ratings.csv"         # subject,day,condition,examiner,score
exclusions = "exclusions.csv"   # path,epoch,reason,by
# A blinding key (code,condition) is key.csv in this folder, or given with --key FILE. Without one,
# codes stay codes.

[conditions.OFF]
title = "stimulation off"

# What was not written down may be left out; the amplitude is amplitude_v or amplitude_ma.
[conditions.DBS]
title = "stimulation on"
# frequency_hz = 130.0
# amplitude_ma = 2.5
# pulse_width_us = 60.0
# electrodes = "1-2+"
# wash_in_min = 15.0

[rating]
scale = [0.0, 3.0]   # lowest and highest score
step = 0.5           # 0 for none

[analysis]
method = "auto"      # as --method takes it
"""

ABOUT = {
    "sessions": "# One row a recording: a session folder, or a file with the standard names.\n"
    "# part distinguishes two sessions of one day in one condition.\n",
    "ratings": "# One row a score.\n",
    "exclusions": "# Epochs that you take out: which, why, and who says so.\n",
}


def write_new_study(folder: Path, title: str = "") -> None:
    """Make a study folder; without a title it has the folder's name.

    Raises
    ------
    UserError
        If one of its files is there already, or the folder cannot be written.
    """
    names = (STUDY_FILE, *(f"{name}.csv" for name in ABOUT))
    there = [name for name in names if (folder / name).exists()]
    if there:
        raise UserError(
            f"{folder / there[0]}: is there already; a study is never written over, so name "
            "another folder"
        )
    with refused(folder, "cannot be made"):
        folder.mkdir(parents=True, exist_ok=True)
    for name, about in ABOUT.items():
        needed, allowed = TABLE_COLUMNS[name]
        columns = [*needed, *(column for column in allowed if name == "sessions" or column == "by")]
        write_text(folder / f"{name}.csv", f"{about}{','.join(columns)}\n")
    shown = json.dumps(title.strip() or folder.resolve().name, ensure_ascii=False)
    write_text(folder / STUDY_FILE, SKELETON.format(title=shown))
