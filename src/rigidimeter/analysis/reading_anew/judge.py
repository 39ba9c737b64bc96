"""A file under one mapping: its signals, what they look like, and what the gate says of them."""

from __future__ import annotations

import itertools
import shlex
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field, replace

from rigidimeter.analysis.reading_anew.clock import may_be_ticks
from rigidimeter.analysis.reading_anew.columns import Array, Columns
from rigidimeter.analysis.reading_anew.gate import Broken, broken, is_exchanged, is_reaction
from rigidimeter.analysis.reading_anew.labels import unused_labels
from rigidimeter.analysis.reading_anew.mapping import NONE, Fault, Mapping
from rigidimeter.analysis.reading_anew.quantities import MOTION, QUANTITIES
from rigidimeter.analysis.reading_anew.seen import Seen, look
from rigidimeter.analysis.reading_anew.signals import SENSORS, Signals, for_gate, signals
from rigidimeter.analysis.reading_anew.units import Conversion, factor

RARE_TIME_UNITS = ("us", "ns", "days")
MOST_READINGS = 8


@dataclass
class Verdict:
    """What is known of a file under one mapping.

    Parameters
    ----------
    found : Signals
    seen : Seen or None
        None where torque and motion are no numbers, or have no time.
    faults : list of Fault
        It is not read while there is one.
    warnings : list of Fault
        What is not used, and what a person said that no joint is like.
    """

    found: Signals
    seen: Seen | None = None
    faults: list[Fault] = field(default_factory=list)
    warnings: list[Fault] = field(default_factory=list)

    @property
    def sentences(self) -> list[str]:
        """What is wrong, a line each, with what would put it right; all of it at once."""
        lines = [fault.sentence(self.found.said) for fault in self.faults]
        return list(dict.fromkeys(lines))


def verdict(file: Columns, said: Mapping, read: dict[str, Array] | None = None) -> Verdict:
    """Return what is known of a file under a mapping.

    Parameters
    ----------
    file : Columns
    said : Mapping
    read : dict of str to array, optional
        As of `signals`.
    """
    found = signals(file, said, read)
    result = Verdict(found, faults=list(found.faults), warnings=list(found.chosen.unused))
    if not found.are_enough:
        return result
    used = {*found.chosen.columns.values(), *found.chosen.labels.values()}
    labelled = {*found.chosen.labels, *(key for one in file.intervals for key in one.labels)}
    lacking = [label for label in ("epoch", "condition") if label not in labelled]
    n_rows = found.raw["torque"].size
    result.warnings += unused_labels(file, said, used, n_rows, lacking)
    result.seen = seen_as(file, found)
    if found.chosen.unstated:
        result.faults = [_with_readings(file, result, fault) for fault in result.faults]
    elif result.seen is not None and not result.faults:
        _judge(file, result, result.seen)
    return result


def seen_as(file: Columns, found: Signals, units: Dict[str, str] | None = None) -> Seen | None:
    """Look at signals in the units that are stated, or in those of `units`; None if too few."""
    varied = {name: Conversion(factor(unit, name) or 1.0) for name, unit in (units or {}).items()}
    shown = for_gate(file, found, found.chosen.to_si | varied)
    if shown is None:
        return None
    return look(shown["torque"], shown.get("angle"), shown.get("velocity"))


def usual_units(file: Columns, found: Signals, name: str) -> tuple[str, ...]:
    """Return the usual units of a quantity; of a time that is neither in s nor in ms, more."""
    usual = QUANTITIES[name].usual
    if name != "time" or "time" not in found.raw:
        return usual
    if _possible(file, found, usual):
        return usual
    return _possible(file, found, RARE_TIME_UNITS) or (*usual, *RARE_TIME_UNITS)


def _possible(file: Columns, found: Signals, units: tuple[str, ...]) -> tuple[str, ...]:
    """Return those of some units of the time with which a recording may be one."""
    seen = {unit: seen_as(file, found, {"time": unit}) for unit in units}
    return tuple(
        unit
        for unit, one in seen.items()
        if one is None or all(b.rule.quantity != "time" for b in broken(one))
    )


def _judge(file: Columns, result: Verdict, seen: Seen) -> None:
    """Add what the gate says: a clock that cannot be, then signs, then units."""
    found = result.found
    sizes = {name: found.chosen.to_si[name].size for name in SENSORS if name in found.chosen.to_si}
    every = broken(seen, sizes)
    of_clock = any(one.rule.quantity == "time" for one in every)
    if not of_clock and (fault := _of_signs(file, found, seen)) is not None:
        result.faults.append(fault)
        return
    for one in every:
        fault, is_said = _of_rule(file, found, one)
        (result.warnings if is_said else result.faults).append(fault)


def _of_signs(file: Columns, found: Signals, seen: Seen) -> Fault | None:
    motion = next(name for name in MOTION if name in found.chosen.columns)
    columns = [found.chosen.columns[name] for name in ("torque", motion)]
    shown = " and ".join(map(repr, columns))
    fit, swapped, said = seen.fit, seen.swapped, found.said
    if fit is not None and swapped is not None and is_exchanged(seen):
        text = f"{file.source}: {shown} are exchanged: R² is {fit.r_squared:.2f} as they are, and"
        text += f" {swapped.r_squared:.2f} the other way round, with the signs of a joint"
        option = " ".join(
            f"--column {shlex.quote(f'{name}={column}')}"
            for name, column in zip(("torque", motion), reversed(columns), strict=True)
        )
        return Fault(text, "exchanged", "torque", blank=f"{option} and the unit of each")
    if fit is not None and is_reaction(seen):
        text = f"{file.source}: {shown} give {fit.text}: the torque has the sign of the joint's"
        text += " reaction, or the angle is reversed"
        if said.reaction:
            return Fault(f"{text}; leave out --reaction", "sign", "torque")
        return Fault(text, "sign", "torque", (said.saying(reaction=True),))
    return None


def _of_rule(file: Columns, found: Signals, one: Broken) -> tuple[Fault, bool]:
    """Return a broken rule as a fault, and whether a person said what it contradicts."""
    name, said, rule = one.rule.quantity, found.said, one.rule
    column = found.chosen.columns.get(name)
    if column is None:
        is_said = said.rate_hz is not None
        remedy = "check the clock that the file states"
        if found.rate_hz is not None:
            remedy = "check --rate-hz" if is_said else "say --rate-hz"
        return Fault(f"{file.source}: {one.text}; {remedy}", rule.name, name), is_said
    if name in found.chosen.of_user and rule.beside:
        name = rule.beside
        column = found.chosen.columns[name]
    unit = found.chosen.mapping.pick(name).unit
    text = f"{file.source}: column {column!r} is in {unit}, but {one.text}"
    if name in found.chosen.of_user:
        text += "; it is read as the unit that was given says"
        return Fault(text, rule.name, name), True
    if rule.beside:
        return _matching(file, found, one, text), False
    units = usual_units(file, found, name)
    if QUANTITIES[name].confused:
        units = (QUANTITIES[name].usual[0], QUANTITIES[name].confused)
    remedies = tuple(said.saying(**{name: {"unit": u}}) for u in units)
    blank = _of_time(found) if name == "time" else ""
    fault = Fault(text, rule.name, name, remedies, blank)
    return _with_lines(file, found, fault, {name: units}), False


def _of_time(found: Signals) -> str:
    """Return what a time may be that is no time yet: sample numbers, or ticks of a clock."""
    if found.numbers_rows:
        return f"--rate-hz, if {found.chosen.columns['time']!r} numbers the samples"
    if "time" in found.raw and may_be_ticks(found.raw["time"]):
        return "--scale 'time=0.0001 s', if it counts ticks of that length"
    return ""


def _matching(file: Columns, found: Signals, one: Broken, text: str) -> Fault:
    """Return the options with which a velocity is the derivative of the angle beside it."""
    said = found.said
    remedies = []
    for name in ("velocity", "angle"):
        for unit in QUANTITIES[name].usual:
            seen = seen_as(file, found, {name: unit})
            if seen is not None and not broken(seen):
                remedies.append(said.saying(**{name: {"unit": unit}}))
    if not remedies and abs(one.value + 1.0) < 0.3:
        remedies.append(said.saying(velocity={"scale": "-1"}))
    if not remedies:
        text += "; check both units and the rate, or leave one out"
        remedies = [said.saying(**{name: {"column": NONE}}) for name in ("velocity", "angle")]
    return Fault(text, one.rule.name, "velocity", tuple(remedies))


def _with_readings(file: Columns, result: Verdict, fault: Fault) -> Fault:
    """Add what a recording looks like in each of the units that may be its."""
    found = result.found
    if fault.rule != "unit":
        return fault
    units = {name: usual_units(file, found, name) for name in found.chosen.unstated}
    blank = fault.blank
    if "torque" in units:
        blank += " or --scale 'torque=0.001 Nm', if its values are counts of that size"
    if "time" in found.chosen.columns and (more := _of_time(found)):
        blank += f" or {more}"
    return _with_lines(file, found, replace(fault, blank=blank), units)


def _with_lines(
    file: Columns, found: Signals, fault: Fault, units: Dict[str, tuple[str, ...]]
) -> Fault:
    """Add a line for each reading of quantities in some units."""
    motion = next(name for name in MOTION if name in found.raw)
    varied = {name: units[name] for name in ("time", "torque", motion) if name in units}
    if not varied:  # a velocity beside an angle: J, B and K are by the angle
        return fault
    lines = []
    for as_units in _products(varied):
        seen = seen_as(file, found, as_units)
        if seen is not None:
            shown = ", ".join(f"{name} as {unit}" for name, unit in as_units.items())
            wrong = "; ".join(one.text for one in broken(seen))
            lines.append(f"  {shown}: {seen.text}" + (f" ({wrong})" if wrong else ""))
    return replace(fault, lines=tuple(lines[:MOST_READINGS]))


def _products(units: Dict[str, tuple[str, ...]]) -> list[dict[str, str]]:
    return [dict(zip(units, one, strict=True)) for one in itertools.product(*units.values())]
