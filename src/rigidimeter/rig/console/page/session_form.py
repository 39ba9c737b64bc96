"""The form before a session: what can be entered, and what session that makes.

A form is a mapping of text, so it can be kept as it is, also where it is wrong. `read_form` says
for each field what is wrong, in the sentences of the settings.
"""

from __future__ import annotations

import hashlib
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from operator import getitem
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, changed_settings, dump_settings, validated
from rigidimeter.core.study_files import ConditionTable, PrimaryTable, primary_named, primary_words
from rigidimeter.rig.console.page.form_values import (
    parse_integer,
    parse_line,
    parse_name,
    parse_number,
    parse_numbers,
)
from rigidimeter.rig.devices import MotionRange


@dataclass(frozen=True)
class Field:
    """A field: its key in the form, what it is called, its unit, and where it belongs.

    `path` is the place in the settings, or in `stimulation`; empty for other fields.
    """

    key: str
    label: str
    unit: str = ""
    path: str = ""


METADATA = (Field("subject", "Subject (code)"), Field("operator", "Operator"))
NOTE = Field("note", "Note on the session")
DAY = Field("day", "Day of the study")
"""Asked for beside a plan alone; without it the session would be of a day of its own."""
RANGE = (
    Field("range_low", "Range of motion: lower end", "deg"),
    Field("range_high", "Range of motion: upper end", "deg"),
    Field("range_of", "Range of motion: of whom (code)"),
)
"""Of this person, for this session: never kept, and taken for the subject that it names alone."""

SETTINGS = (
    Field("prbs_amplitude", "PRBS: amplitude", "N·m", "prbs.amplitude_nm"),
    Field("prbs_duration", "PRBS: duration of an epoch", "s", "prbs.duration_s"),
    Field("prbs_clock", "PRBS: clock", "Hz", "prbs.clock_hz"),
    Field("sin_frequency", "Sinusoid: frequency", "Hz", "sinusoid.frequency_hz"),
    Field("sin_amplitude", "Sinusoid: amplitude", "deg", "sinusoid.amplitude_deg"),
    Field("return", "Return to the start", "s", "protocol.return_s"),
    Field("inertia", "Controller: inertia", "kg·m²", "controller.inertia_kg_m2"),
    Field("damping", "Controller: damping", "N·m·s/rad", "controller.damping_nm_s_rad"),
    Field("torque_limit", "Guard: torque at which the rig holds", "N·m", "guard.torque_limit_nm"),
    Field("position_limit", "Guard: largest angle", "deg", "guard.position_limit_deg"),
)

STIMULATION = (
    Field("stim_frequency", "Stimulation: frequency", "Hz", "frequency_hz"),
    Field("stim_volts", "Stimulation: amplitude", "V", "amplitude_v"),
    Field("stim_ma", "Stimulation: amplitude", "mA", "amplitude_ma"),
    Field("stim_width", "Stimulation: pulse width", "µs", "pulse_width_us"),
    Field("stim_electrodes", "Stimulation: electrodes"),
    Field("stim_wash_in", "Stimulation: since", "min", "wash_in_min"),
)

BLINDED, YES = "blinded", "yes"
"""The box that hides conditions behind codes, and what it holds where it is ticked."""

PRIMARY = "primary"
PRIMARIES: Mapping[str, PrimaryTable] = {
    primary_words(one): one
    for one in (
        primary_named("stiffness,damping"),
        primary_named("stiffness"),
        primary_named("damping"),
        primary_named("stiffness,damping", "sequence"),
        primary_named("damping,stiffness", "sequence"),
    )
}
"""What may be declared as the primary measures of the study; a form that declares none is empty."""

_OF_THE_SESSION = (*(one.key for one in (*METADATA, NOTE, *RANGE, *STIMULATION)), BLINDED, PRIMARY)
"""Fields that no protocol fills."""

_NEVER_KEPT = {one.key for one in RANGE}

MAX_BLOCKS = 12
"""To which blocks can be added; a protocol may have more."""

LONGEST_VALUE = 400

_OF_A_BLOCK = re.compile(r"(task|condition|epochs)\d+")
_PLACES = {one.path: one.key for one in SETTINGS} | {"protocol.rests_s": "rests"}
_BLOCK = re.compile(r"protocol\.blocks\[(\d+)\]\.(\w+)")


@dataclass(frozen=True)
class EnteredSession:
    """What a form says: settings and facts about the session, and what is wrong with it.

    `settings` is None as long as something is wrong; `errors` has a sentence for each field, under
    the key "" what belongs to none. `primary` is what the form declares, if it does.
    """

    settings: Settings | None
    about: Mapping[str, Any]
    subject: str
    errors: Mapping[str, str] = field(default_factory=dict)
    primary: PrimaryTable | None = None


def empty_form(settings: Settings) -> dict[str, str]:
    """Return the form that makes these settings."""
    values = dump_settings(settings)
    form = dict.fromkeys(_OF_THE_SESSION, "")
    form["protocol"] = hashlib.sha256(repr(values).encode()).hexdigest()[:16]
    form |= _shown(values)
    for k, block in enumerate(settings.protocol.blocks):
        form |= block_form(k, block.task, block.condition, str(block.epochs))
    return form


def _shown(values: Mapping[str, Any]) -> dict[str, str]:
    """Return the settings as the form shows them: with fewer digits than they may have."""
    shown = {one.key: f"{reduce(getitem, one.path.split('.'), values):.10g}" for one in SETTINGS}
    return shown | {
        "rests": "; ".join(f"{rest_s:.10g}" for rest_s in values["protocol"]["rests_s"])
    }


def block_form(k: int, task: str, condition: str, epochs: str) -> dict[str, str]:
    """Return the fields of a block of epochs."""
    return {f"task{k}": task, f"condition{k}": condition, f"epochs{k}": epochs}


def blocks_of(form: Mapping[str, str]) -> list[int]:
    """Return the numbers of the blocks of a form."""
    return list(itertools.takewhile(lambda k: f"task{k}" in form, itertools.count()))


def restored_form(stored: Any, settings: Settings) -> dict[str, str]:
    """Return a form that was kept, so far as it is one; otherwise the form of the settings.

    Of a form that was made from other settings, what these say is not kept.
    """
    form = empty_form(settings)
    if not isinstance(stored, dict):
        return form
    found = {
        key: value
        for key, value in stored.items()
        if isinstance(value, str) and len(value) <= LONGEST_VALUE and key not in _NEVER_KEPT
    }
    if found.get("protocol") != form["protocol"]:
        return form | {key: value for key, value in found.items() if key in _OF_THE_SESSION}
    blocks = {f"{part}{k}" for k in blocks_of(found) for part in ("task", "condition", "epochs")}
    if blocks and blocks <= found.keys():
        form = {key: value for key, value in form.items() if not _OF_A_BLOCK.fullmatch(key)}
    return form | {key: value for key, value in found.items() if key in form or key in blocks}


def read_form(form: Mapping[str, str], base: Settings) -> EnteredSession:
    """Return what a form says, with all that is wrong with it.

    Parameters
    ----------
    form : mapping of str to str
    base : Settings
        What the form does not ask for.
    """
    errors: dict[str, str] = {}

    def read(key: str, reader: Any, *arguments: Any) -> Any:
        try:
            return reader(form.get(key, ""), *arguments)
        except UserError as error:
            errors[key] = str(error)
            return None

    shown = _shown(dump_settings(base))
    changes: dict[str, Any] = {}
    for one in SETTINGS:
        # What is as it was shown is the protocol's own value, which may have more digits.
        if form.get(one.key, "").strip() == shown[one.key]:
            continue
        value = read(one.key, parse_number, one.label)
        if value is not None:
            table, _, key = one.path.partition(".")
            changes.setdefault(table, {})[key] = value
    blocks = []
    for k in blocks_of(form):
        condition = read(f"condition{k}", parse_name, "condition")
        epochs = read(f"epochs{k}", parse_integer, "epochs")
        blocks.append({"task": form[f"task{k}"], "condition": condition, "epochs": epochs})
    changes.setdefault("protocol", {})["blocks"] = blocks
    if form.get("rests", "").strip() != shown["rests"]:
        changes["protocol"]["rests_s"] = read("rests", parse_numbers, "rests")
    about: dict[str, Any] = {
        "subject": read("subject", parse_name, "subject"),
        "operator": read("operator", _needed, "operator"),
        "note": read("note", parse_line, "note"),
        "blinded": form.get(BLINDED) == YES,
    }
    if DAY.key in form:
        about["day"] = read(DAY.key, _needed, "day of the study")
    if any(form.get(one.key, "").strip() for one in RANGE):
        about["range"] = read("range_low", read_range, form, about["subject"], errors)
    stimulation: dict[str, Any] = {}
    for one in STIMULATION:
        text = form.get(one.key, "").strip()
        if text and one.path:
            stimulation[one.path] = read(one.key, parse_number, one.label)
        elif text:
            stimulation["electrodes"] = read(one.key, parse_line, one.label)
    if errors:
        return EnteredSession(None, about, about["subject"] or "", errors)
    settings = None
    try:
        entered = validated(ConditionTable, stimulation, "stimulation")
        if stimulation:
            about["stimulation"] = entered.model_dump(exclude_unset=True)
    except UserError as error:
        errors |= placed(error, {one.path: one.key for one in STIMULATION if one.path})
    try:
        settings = changed_settings(_with_subjects(base, blocks), changes, "form")
    except UserError as error:
        errors |= placed(error, _PLACES)
    about["conditions"] = list(dict.fromkeys(block["condition"] for block in blocks))
    primary = PRIMARIES.get(form.get(PRIMARY, ""))
    return EnteredSession(None if errors else settings, about, about["subject"], errors, primary)


def _with_subjects(base: Settings, blocks: Sequence[Mapping[str, Any]]) -> Settings:
    """Return settings in which each condition has a virtual joint: the first one if none is.

    Conditions may be codes, of which the settings know nothing.
    """
    known = dump_settings(base)["subject"]
    first = next(iter(known.values()))
    more = {block["condition"]: first for block in blocks if block["condition"] not in known}
    return changed_settings(base, {"subject": more}, "form") if more else base


def placed(error: UserError, fields: Mapping[str, str]) -> dict[str, str]:
    """Return each sentence under the field that `fields` has for its place; others under none."""
    found: dict[str, list[str]] = {}
    for place, sentence in (error.places or {"": str(error)}).items():
        block = _BLOCK.match(place)
        known = next((key for path, key in fields.items() if place.startswith(path)), "")
        found.setdefault(f"{block[2]}{block[1]}" if block else known, []).append(sentence)
    return {key: "; ".join(sentences) for key, sentences in found.items()}


def read_range(
    low: str, form: Mapping[str, str], subject: str | None, errors: dict[str, str]
) -> dict[str, Any] | None:
    """Return the range of motion that was entered; what is wrong with its other fields is said."""
    of_whom = form.get("range_of", "").strip()
    if of_whom != (subject or ""):
        errors["range_of"] = (
            f"range of motion: entered for {of_whom or 'nobody'}, and the subject is "
            f"{subject or 'not named'}; lead this person's arm through its range and enter that"
        )
    try:
        high_deg = parse_number(form.get("range_high", ""), "upper end")
    except UserError as error:
        errors["range_high"] = str(error)
        return None
    return MotionRange(parse_number(low, "lower end"), high_deg, subject=of_whom).facts()


def _needed(text: str, what: str) -> str:
    entered = parse_line(text, what, 40)
    if not entered:
        raise UserError(f"{what}: must be given")
    return entered
