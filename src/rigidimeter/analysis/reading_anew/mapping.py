"""A mapping: which column is which quantity, in what unit, and how a file is opened.

Options of the command line, keywords of `read`, a TOML file and what `inspect` proposes are four
spellings of one `Mapping`, made from its fields.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field, field_validator

from rigidimeter.analysis.reading_anew.columns import nearest
from rigidimeter.analysis.reading_anew.quantities import BY_STORED, EMG, LABELS, QUANTITIES
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import SAMPLING_RATE_HZ, toml_text
from rigidimeter.core.records import Task
from rigidimeter.core.settings import Section, read_section, validated

MAPPING_SCHEMA = "rigidimeter.mapping/1"
NONE = "none"
"""In place of a column: the quantity is left out. In place of codes: no number is one."""


class Pick(Section):
    """What is said of one quantity: the column, its unit, and how its values become that quantity.

    `scale` is what the values are multiplied by (``2.5 Nm/V``), `offset` what they are at zero.
    Nothing is said by an empty text.
    """

    column: str = Field("", max_length=200)
    unit: str = Field("", max_length=40)
    scale: str = Field("", max_length=80)
    offset: str = Field("", max_length=80)

    @property
    def leaves_out(self) -> bool:
        """Whether the quantity is left out on purpose."""
        return self.column == NONE


class Mapping(Section):
    """How the files of one laboratory are read; what is not said is left to the file.

    Parameters
    ----------
    time, torque, angle, velocity, velocity_command, perturbation, emg, … : Pick
    epoch_column, condition_column, task_column : str
        Columns of labels.
    rate_hz : float or None
        The sampling rate, for files without a time column.
    reaction : bool
        The torque is the joint's reaction: its sign is turned.
    epoch_length_s : float or None
        Cut a file without an epoch column into epochs of this length.
    task : {"prbs", "sinusoid"} or None
        For files without a task column.
    skip_rows : int
        Lines at the beginning of a text that are not read.
    names : tuple of str
        Of the columns of a text that does not name them.
    table : str
        The sheet or the variable that is read, of a file with several.
    missing : str
        The numbers, with commas between them, that stand for lost samples of torque and motion;
        ``none`` where no number does. Where nothing is said they are found.
    """

    time: Pick = Pick()
    torque: Pick = Pick()
    angle: Pick = Pick()
    velocity: Pick = Pick()
    velocity_command: Pick = Pick()
    perturbation: Pick = Pick()
    emg: Pick = Pick()
    emg_2: Pick = Pick()
    emg_3: Pick = Pick()
    emg_4: Pick = Pick()
    emg_5: Pick = Pick()
    emg_6: Pick = Pick()
    emg_7: Pick = Pick()
    emg_8: Pick = Pick()
    epoch_column: str = Field("", max_length=200)
    condition_column: str = Field("", max_length=200)
    task_column: str = Field("", max_length=200)
    rate_hz: float | None = Field(
        None, ge=SAMPLING_RATE_HZ[0], le=SAMPLING_RATE_HZ[1], json_schema_extra={"unit": "Hz"}
    )
    reaction: bool = False
    epoch_length_s: float | None = Field(None, gt=0.0, json_schema_extra={"unit": "s"})
    task: Task | None = None
    skip_rows: int = Field(0, ge=0, le=1_000_000)
    names: tuple[str, ...] = Field((), max_length=2000, strict=False)
    table: str = Field("", max_length=200)
    missing: str = Field("", max_length=200)

    @field_validator("missing")
    @classmethod
    def _are_numbers(cls, text: str) -> str:
        _codes(text)
        return text

    def pick(self, quantity: str) -> Pick:
        """Return what is said of a quantity."""
        found = getattr(self, quantity)
        assert isinstance(found, Pick)
        return found

    def label(self, name: str) -> str:
        """Return the column of the labels ``epoch``, ``condition`` or ``task``, as it is said."""
        return str(getattr(self, f"{name}_column"))

    @property
    def said_of(self) -> dict[str, Pick]:
        """What is said of each quantity of which anything is."""
        return {name: self.pick(name) for name in QUANTITIES if self.pick(name) != Pick()}

    @property
    def codes(self) -> tuple[float, ...] | None:
        """The numbers that stand for lost samples; None where they are to be found."""
        return _codes(self.missing)

    def saying(self, **changes: Any) -> Mapping:
        """Return a mapping with some fields changed: ``torque={"unit": "Nm"}`` adds to a pick."""
        merged = {
            name: self.pick(name).model_copy(update=value) if name in QUANTITIES else value
            for name, value in changes.items()
        }
        return self.model_copy(update=merged)


@dataclass(frozen=True)
class Fault:
    """What is wrong with a reading of a file, or not known of it.

    Parameters
    ----------
    text : str
        The sentence, without what to do about it.
    rule : str
        Of the gate, where one was broken.
    quantity : str
    remedies : tuple of Mapping
        What would put it right: changed mappings, of which a person or the search chooses one.
    blank : str
        An option with a blank that only a person can fill in.
    lines : tuple of str
        What the recording looks like with each remedy.
    because : str
        Why the remedies are those, behind them.
    """

    text: str
    rule: str = ""
    quantity: str = ""
    remedies: tuple[Mapping, ...] = ()
    blank: str = ""
    lines: tuple[str, ...] = ()
    because: str = ""

    def sentence(self, said: Mapping) -> str:
        """Return what is wrong, and the options that would put it right beside those given."""
        options = [shlex.join(words(one, said)) for one in self.remedies]
        if self.blank:
            options.append(self.blank)
        if not options:
            return "\n".join([self.text, *self.lines])
        text = f"{self.text}; say {' or '.join(dict.fromkeys(options))}{self.because}"
        return "\n".join([text, *self.lines])


def mapping_of(
    *,
    column: Dict[str, str] | None = None,
    unit: Dict[str, str] | None = None,
    scale: Dict[str, str] | None = None,
    offset: Dict[str, str] | None = None,
    missing: str | Sequence[float] = "",
    mapping: str | Path | None = None,
    **others: Any,
) -> Mapping:
    """Return the keywords of `read`, or the options of the command line, as a mapping.

    Parameters
    ----------
    column, unit, scale, offset : mapping of str to str, optional
        By quantity: ``{"torque": "Fz"}``; ``{"torque_nm": "Fz"}`` says the unit of the column too.
    missing : str or sequence of float
    mapping : path, optional
        A mapping file, which is used where a keyword says nothing.
    **others
        The fields of `Mapping` that are not of one quantity.

    Raises
    ------
    UserError
        If one is wrong.

    Examples
    --------
    >>> mapping_of(column={"torque": "Fz"}, unit={"torque": "mNm"}).torque.unit
    'mNm'
    """
    changed: dict[str, dict[str, str]] = {}
    labels: dict[str, str] = {}
    for key, given in {"column": column, "unit": unit, "scale": scale, "offset": offset}.items():
        for name, text in _by_name(key, given).items():
            if key == "column" and name in LABELS:
                labels[f"{name}_column"] = text
                continue
            quantity = _quantity(name, f"--{key} {shlex.quote(f'{name}={text}')}")
            changed.setdefault(quantity, {})[key] = text
            if key == "column" and name in BY_STORED:
                changed[quantity].setdefault("unit", BY_STORED[name].usual[0])
    for quantity, pick in changed.items():
        if "scale" in pick and not (unit or {}).keys() & {quantity, QUANTITIES[quantity].stored}:
            pick.pop("unit", None)  # of `torque_nm=Fz` with a scale the unit is what it becomes
    codes = missing if isinstance(missing, str) else ",".join(f"{one:g}" for one in missing)
    values = {**changed, **labels, **others, "missing": codes}
    said = validated(Mapping, values, "how to read")
    return said if mapping is None else merged(read_mapping(Path(mapping)), said)


def words(mapping: Mapping, beside: Mapping | None = None) -> list[str]:
    """Return the options of the command line that say a mapping.

    Parameters
    ----------
    mapping : Mapping
    beside : Mapping, optional
        What was said already: only what differs is returned.

    Examples
    --------
    >>> words(Mapping(torque=Pick(column="Fz", scale="0.2 m"), reaction=True))
    ['--column', 'torque=Fz', '--scale', 'torque=0.2 m', '--reaction']
    """
    known = beside or Mapping()
    found: list[str] = []
    for key in Pick.model_fields:
        for name in QUANTITIES:
            text = getattr(mapping.pick(name), key)
            if text and text != getattr(known.pick(name), key):
                found += [f"--{key}", f"{name}={text}"]
    for label in LABELS:
        if mapping.label(label) != known.label(label):
            found += ["--column", f"{label}={mapping.label(label)}"]
    for name in _PLAIN:
        value, option = getattr(mapping, name), f"--{name.replace('_', '-')}"
        if not value or value == getattr(known, name):
            continue
        if value is True:
            found.append(option)
        else:
            found += [option, _as_word(value)]
    return found


def mapping_text(mapping: Mapping) -> str:
    """Return a mapping file: only what is said, the quantities as tables."""
    plain: dict[str, Any] = {"schema": MAPPING_SCHEMA}
    plain |= mapping.model_dump(mode="json", exclude_defaults=True, exclude=set(QUANTITIES))
    tables = {
        name: pick.model_dump(exclude_defaults=True) for name, pick in mapping.said_of.items()
    }
    return toml_text({**plain, **tables})


def read_mapping(path: Path) -> Mapping:
    """Read a mapping file.

    Raises
    ------
    UserError
        Naming each offending key, its value, and what would be right.
    """
    return read_section(path, MAPPING_SCHEMA, Mapping)


def merged(file: Mapping, said: Mapping) -> Mapping:
    """Return a mapping file's mapping with what the user says before it."""
    changes: dict[str, Any] = {
        name: {key: text for key, text in pick.model_dump().items() if text}
        for name, pick in said.said_of.items()
    }
    default = Mapping()
    for name in (*_PLAIN, *(f"{label}_column" for label in LABELS)):
        if getattr(said, name) != getattr(default, name):
            changes[name] = getattr(said, name)
    return file.saying(**changes)


# The fields that are of no quantity and no label.
_PLAIN = tuple(
    name
    for name in Mapping.model_fields
    if name not in QUANTITIES and name not in {f"{label}_column" for label in LABELS}
)


def of_every_muscle(mapping: Mapping) -> Mapping:
    """Return a mapping in which what is said of ``emg`` holds for each muscle without its own."""
    first = mapping.emg
    said = {"unit": first.unit, "scale": first.scale, "offset": first.offset}
    changes = {
        name: {key: text for key, text in said.items() if not getattr(mapping.pick(name), key)}
        for name in EMG[1:]
    }
    return mapping.saying(**changes) if any(said.values()) else mapping


def _codes(text: str) -> tuple[float, ...] | None:
    if text in ("", NONE):
        return () if text else None
    try:
        values = tuple(float(one) for one in text.split(","))
    except ValueError:
        values = (math.nan,)
    if not all(map(math.isfinite, values)):
        raise ValueError("must be numbers with commas, as in 0,-999, or none")
    return values


def _by_name(argument: str, given: object) -> dict[str, str]:
    found = {} if given is None else given
    if not isinstance(found, Dict) or not all(isinstance(one, str) for one in found.values()):
        example = {"column": "'torque': 'Fz'", "unit": "'angle': 'deg'"}
        shown = example.get(argument, "'torque': '2.5 Nm/V'")
        raise UserError(f"{argument} maps quantities to texts, as in {{{shown}}}; got {given!r}")
    return dict(found)


def _quantity(name: str, option: str) -> str:
    if name in QUANTITIES:
        return name
    if name in BY_STORED:
        return BY_STORED[name].name
    known = (*QUANTITIES, *LABELS)
    raise UserError(
        f"{option}: {name} is not a name that is read; the nearest is {nearest(name, known)} "
        f"(known are {', '.join(known)})"
    )


def _as_word(value: object) -> str:
    if isinstance(value, tuple):
        return ",".join(value)
    return f"{value:g}" if isinstance(value, float) else str(value)
