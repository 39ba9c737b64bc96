"""The primary measures of a study: named by a person, and declared in `study.toml` with the date.

A declaration can be changed until the first session is recorded, and not afterwards.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import get_args

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import DOCUMENT_BYTES, read_bytes, write_text
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.settings import validated
from rigidimeter.core.study_files.extended_folder import write_new_study
from rigidimeter.core.study_files.folder import is_study
from rigidimeter.core.study_files.study_toml import (
    STUDY_FILE,
    ConditionTable,
    PrimaryMeasure,
    PrimaryTable,
    is_own,
    own_text,
    pair_of,
    primary_text,
    read_study_toml,
    study_text,
)
from rigidimeter.core.study_files.tables import table_path, table_rows

_SHORT = {name.partition("_")[0]: name for name in get_args(PrimaryMeasure)}
"""What people call the measures."""

_SYMBOLS = {parameter.symbol: parameter.name.partition("_")[0] for parameter in PARAMETERS}

_TABLE = re.compile(r"^\[primary\][^\n]*\n(?:(?!\[)[^\n]*\n?)*", re.MULTILINE)


def primary_named(names: str, rule: str = "holm", **more: object) -> PrimaryTable:
    """Return the primary measures that a person named.

    Parameters
    ----------
    names : str
        Such as ``stiffness,damping`` or ``K,B``, in the order of a sequence.
    rule : str
        ``holm`` or ``sequence``.
    **more
        Other fields of `PrimaryTable`.

    Raises
    ------
    UserError
        If a name or the rule is unknown.

    Examples
    --------
    >>> primary_named("damping, stiffness", "sequence").measures
    ['damping_nm_s_rad', 'stiffness_nm_rad']
    """
    measures = []
    for name in (_SYMBOLS.get(part.strip(), part.strip()) for part in names.split(",")):
        if name == "inertia":
            raise UserError(
                f"--primary {names}: inertia checks the instrument, and is no outcome; name "
                f"{', '.join(_SHORT)}"
            )
        if name not in (*_SHORT, *_SHORT.values()):
            near = difflib.get_close_matches(name, _SHORT, n=1)
            known = f"did you mean {near[0]}?" if near else f"known: {', '.join(_SHORT)}"
            raise UserError(f'--primary {names}: unknown measure "{name}"; {known}')
        measures.append(_SHORT.get(name, name))
    if rule not in ("holm", "sequence"):
        raise UserError(f"--rule {rule}: unknown rule; write holm or sequence")
    return validated(PrimaryTable, {"measures": measures, "rule": rule, **more}, "--primary")


def primary_words(primary: PrimaryTable) -> str:
    """Return the primary measures in words.

    Examples
    --------
    >>> primary_words(PrimaryTable()), primary_words(primary_named("stiffness"))
    ('stiffness and damping, by Holm', 'stiffness')
    """
    names = [name.partition("_")[0] for name in primary.measures]
    if len(names) == 1:
        return names[0]
    if primary.rule == "sequence":
        return ", then ".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}, by Holm"


def declared_primary(study: Path) -> PrimaryTable | None:
    """Return what a study folder declares, with its date; None if it declares nothing.

    Raises
    ------
    UserError
        If its `study.toml` cannot be read.
    """
    if not is_study(study):
        return None
    primary = read_study_toml(study / STUDY_FILE).primary
    return None if primary.declared is None else primary


def declare_primary(study: Path, primary: PrimaryTable, known: Sequence[str] | None = None) -> str:
    """Write primary measures into the `study.toml` of a folder, with the date of today.

    Parameters
    ----------
    study : Path
        Without a `study.toml` it is made a study.
    primary : PrimaryTable
    known : sequence of str, optional
        Names of conditions, for a study to which sessions are added as they are recorded; without
        them a study is made whose tables a person fills.

    Returns
    -------
    str
        What was declared, as a sentence.

    Raises
    ------
    UserError
        If sessions were recorded under another declaration, or a file cannot be written.
    """
    path, primary = study / STUDY_FILE, primary.model_copy(update={"declared": date.today()})
    if not is_study(study) and known is None:
        write_new_study(study)
    elif not is_study(study):
        pair = pair_of([], list(known or ()))
        conditions = {name: ConditionTable() for name in pair}
        study.mkdir(parents=True, exist_ok=True)
        write_text(path, own_text(study_text(study.resolve().name, *pair, conditions, primary)))
    before = declared_primary(study)
    if before is not None and _same(before, primary):
        return f"{path}: declares {primary_words(before)}, since {before.declared}"
    recorded = table_rows(table_path(study, "sessions"), "sessions")
    if before is not None and recorded:
        raise UserError(
            f"{path}: declares {primary_words(before)} since {before.declared}, and sessions are "
            "recorded; a declaration is not changed after the data"
        )
    content = read_bytes(path, DOCUMENT_BYTES)
    if is_own(content):
        about = read_study_toml(path)
        pair = about.reference, about.other
        text = own_text(study_text(about.title, *pair, about.conditions, primary))
    else:
        text = _TABLE.sub("", content.decode("utf-8")).rstrip("\n")
        text = f"{text}\n\n{primary_text(primary)}"
        try:
            tomllib.loads(text)
        except tomllib.TOMLDecodeError:
            raise UserError(
                f"{path}: has its primary measures outside a table [primary]; put them into one, "
                "so that they can be declared there"
            ) from None
    write_text(path, text)
    late = "; sessions were recorded before" if recorded else ""
    return f"{path}: declares {primary_words(primary)}, since {primary.declared}{late}"


def _same(one: PrimaryTable, other: PrimaryTable) -> bool:
    return one.model_copy(update={"declared": other.declared}) == other
