"""The text of a `study.toml`, and whether it still is the program's own.

What the program wrote without being asked carries a checksum. Once a person has changed the file,
it is theirs, and nothing is written into it any more.
"""

from __future__ import annotations

from collections.abc import Mapping

from rigidimeter.core.files import text_bytes, toml_text
from rigidimeter.core.session import FIELD, ZEROS, checksum_holds, with_checksum
from rigidimeter.core.study_files.study_toml import STUDY_SCHEMA, ConditionTable

OFF, DBS = "OFF", "DBS"
_TITLES = {OFF: "stimulation off", DBS: "stimulation on"}

_REFERENCE = "# Differences are reference - other.\n"
_TABLES = """\
# The tables, below this folder. Only that of the sessions must exist.
sessions = "sessions.csv"       # path,subject,day,condition,part,note
ratings = "ratings.csv"         # subject,day,condition,examiner,score
exclusions = "exclusions.csv"   # path,epoch,reason,by
# A blinding key (code,condition) is key.csv in this folder, or given with --key FILE. Without one,
# codes stay codes.
"""
_NOT_WRITTEN = """\
# What was not written down may be left out; the amplitude is amplitude_v or amplitude_ma.
# frequency_hz = 130.0
# amplitude_ma = 2.5
# pulse_width_us = 60.0
# electrodes = "1-2+"
# wash_in_min = 15.0
"""
_TAIL = """\
[rating]
scale = [0.0, 3.0]   # lowest and highest score
step = 0.5           # 0 for none

[analysis]
method = "auto"      # as --method takes it
"""
_OWN = (
    "# Written by rigidimeter, which adds conditions and stimulation as sessions are recorded,"
    f'\n# until you change a line.\n# {FIELD.decode()}{ZEROS}"\n'
)


def study_text(
    title: str, reference: str, other: str, conditions: Mapping[str, ConditionTable]
) -> str:
    """Return a `study.toml`, with comments on what may be filled in.

    Parameters
    ----------
    title, reference, other : str
    conditions : mapping of str to ConditionTable
        What is known of the stimulation in each; reference and other at least.
    """
    about = toml_text({"schema": STUDY_SCHEMA, "title": title})
    pair = _REFERENCE + toml_text({"reference": reference, "other": other})
    described = (_condition(*one, reference) for one in conditions.items())
    return "\n".join([about, pair, _TABLES, *described, _TAIL])


def own_text(text: str) -> str:
    """Return a `study.toml` marked as the program's own."""
    return with_checksum(text_bytes(_OWN + text)).decode("utf-8")


def is_own(content: bytes) -> bool:
    """Whether a `study.toml` is as the program wrote it."""
    return checksum_holds(content)


def pair_of(recorded: list[str], known: list[str]) -> tuple[str, str]:
    """Return reference and other: conditions that were recorded, filled up with known ones.

    A name that is not known may be a code.

    Examples
    --------
    >>> pair_of(["DBS", "OFF"], ["OFF", "DBS"]), pair_of(["code A"], ["OFF", "DBS"])
    (('OFF', 'DBS'), ('OFF', 'DBS'))
    """
    named = [name for name in recorded if name in known]
    first, second = list(dict.fromkeys([*named, *known, OFF, DBS]))[:2]
    return (second, first) if second == OFF else (first, second)


def _condition(name: str, table: ConditionTable, reference: str) -> str:
    given = table.model_dump(exclude_unset=True, exclude={"title"})
    title = table.title or _TITLES.get(name, "")
    written = toml_text({"conditions": {name: {"title": title, **given}}})
    return written + (_NOT_WRITTEN if not given and name != reference else "")
