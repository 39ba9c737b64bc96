"""The gate: what numbers must look like to be those of a joint in the units that are stated.

Every rule is a row. Most say what no joint can do; those that tell two units apart say what is
unusual, and refuse a file until a person says that it is right. What a person states is believed: a
rule that it breaks is a warning with the same sentence.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from collections.abc import Mapping as Dict
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.reading_anew.quantities import QUANTITIES
from rigidimeter.analysis.reading_anew.seen import RoughFit, Seen
from rigidimeter.analysis.reading_anew.units import factor

FEWEST = 100
SHORTEST_S = 5.0
"""What is shorter is not estimated."""
LARGEST_POWER_W = 20.0
"""Of an axis that turns on, the default of `guard.power_limit_w`."""
BELIEVED_SPEED_RAD_S = (0.2, 5.0)
"""Joints from a finger to a knee, and a human ankle, reach 0.7 to 0.9 rad/s when they are perturbed
at random, and 2.2 rad/s in a sinusoid of 20° at 1 Hz."""
_CLEAR_R_SQUARED = 0.5
_MUCH = 0.3


class Rule(NamedTuple):
    """One rule.

    Attributes
    ----------
    name : str
    quantity : str
        Whose unit, clock or sign is wrong where it is broken.
    value : callable
        What of `Seen` is measured; NaN where the rule says nothing.
    low, high : float
        From where to where it may be. Of a rule with `confused` the larger unit is believed up to
        `high`, the smaller from `low` on.
    text : str
        What is wrong, with ``{value}``.
    stage : int
        A broken rule of one stage leaves those of later stages without a meaning.
    confused : bool
        The rule tells the stored unit from the one with which it is confused.
    beside : str
        A second quantity whose unit may be the wrong one instead.
    shortest_s : float
        Shorter recordings are not judged by it.
    """

    name: str
    quantity: str
    value: Callable[[Seen], float]
    low: float
    high: float
    text: str
    stage: int
    confused: bool = False
    beside: str = ""
    shortest_s: float = SHORTEST_S


class Broken(NamedTuple):
    """A rule that is broken, by what value, and the sentence."""

    rule: Rule
    value: float
    text: str


def turns_on(seen: Seen) -> bool:
    """Whether an axis turns on and on, as a motor does, at no more than the power of the guard."""
    return seen.turned_rad >= 0.5 * seen.range_rad and seen.power_w <= LARGEST_POWER_W


def _unless_it_turns(value: Callable[[Seen], float]) -> Callable[[Seen], float]:
    return lambda seen: math.nan if turns_on(seen) else value(seen)


def _fast(seen: Seen) -> float:
    """Return the frequency of a motion that was sampled suspiciously fast, or for a moment."""
    return seen.motion_hz if seen.rate_hz > 5e4 or seen.duration_s < SHORTEST_S else math.nan


def _angle_speed(seen: Seen) -> float:
    """Return the speed of an angle of up to one turn; beyond it the angle itself is wrong."""
    return seen.speed_rad_s if seen.largest_rad <= 2 * math.pi else math.nan


def _velocity(seen: Seen) -> float:
    """Return the speed of a velocity; beside an angle that it follows the angle is judged."""
    if seen.largest_rad > 2 * math.pi or not math.isnan(seen.velocity_ratio):
        return math.nan
    return seen.velocity_rad_s


_TOO_SLOW = "{rate:.4g} samples/s and a motion of {motion:.2g} Hz are too slow"
_TOO_FAST = "{rate:.4g} samples/s and a motion of {motion:.2g} Hz are too fast"
_LIMB = "a speed of {value:.4g} rad/s is too fast for a limb"
_INF = math.inf
RULES: tuple[Rule, ...] = (
    Rule("rate", "time", lambda s: s.rate_hz, 5.0, _INF, _TOO_SLOW, 0, shortest_s=0.0),
    Rule("slow motion", "time", lambda s: s.motion_hz, 0.02, _INF, _TOO_SLOW, 0, shortest_s=0.0),
    Rule("fast motion", "time", _fast, 0.0, 100.0, _TOO_FAST, 1, shortest_s=0.0),
    Rule(
        "large torque", "torque", lambda s: s.torque_nm, 0.0, 1000.0,
        "a torque of {value:.4g} N·m is too large", 2,
    ),
    Rule(
        "one turn", "angle", _unless_it_turns(lambda s: s.largest_rad), 0.0, 2 * math.pi,
        "an angle of {value:.4g} rad is more than one turn", 2,
    ),
    # A thrown ball takes more, no measured arm does; 1,150 °/s.
    Rule("speed of the angle", "angle", _unless_it_turns(_angle_speed), 0.0, 20.0, _LIMB, 2),
    Rule("speed of the velocity", "velocity", _unless_it_turns(_velocity), 0.0, 20.0, _LIMB, 2),
    # Noise of 0.5 rad/s, an encoder of 0.1° and a low-pass of 20 Hz leave 0.96 to 1.0; units are
    # 6.3 and 57 apart.
    Rule(
        "both motions", "velocity", lambda s: s.velocity_ratio, 1 / 1.3, 1.3,
        "the velocity is {value:.3g} times the derivative of the angle", 3, beside="angle",
    ),
    # As the units differ by 57 and 1000, no recording is believed in both.
    Rule("N·m or N·mm", "torque", lambda s: s.torque_nm, 0.2, 100.0, "large small", 4, True),
    Rule(
        "rad or deg", "angle", _unless_it_turns(lambda s: s.speed_rad_s), *BELIEVED_SPEED_RAD_S,
        "fast slow", 4, True,
    ),
    Rule(
        "rad/s or deg/s", "velocity", _unless_it_turns(_velocity), *BELIEVED_SPEED_RAD_S,
        "fast slow", 4, True,
    ),
)  # fmt: skip


def broken(seen: Seen, sizes: Dict[str, float] | None = None) -> list[Broken]:
    """Return the rules that a recording breaks, of the first stage of which it breaks any.

    Parameters
    ----------
    seen : Seen
    sizes : mapping of str to float, optional
        By quantity, what 1 of the unit that the file states is in SI, for the rules that tell two
        units apart. Without it these are not asked.

    Examples
    --------
    The same limb with its angle in degrees that are called radians:

    >>> import numpy as np
    >>> from rigidimeter.analysis.reading_anew.seen import look
    >>> t = np.arange(2000) / 100
    >>> seen = look((t, np.sin(t)), (t, 20 * np.sin(6 * t)), None)
    >>> [one.text for one in broken(seen)]
    ['an angle of 20 rad is more than one turn']
    """
    if seen.n_samples < FEWEST:
        return []
    for stage in sorted({rule.stage for rule in RULES}):
        found = [_asked(rule, seen, sizes or {}) for rule in RULES if rule.stage == stage]
        if any(found):
            return [one for one in found if one is not None]
    return []


def _asked(rule: Rule, seen: Seen, sizes: Dict[str, float]) -> Broken | None:
    value = rule.value(seen)
    if math.isnan(value) or seen.duration_s < rule.shortest_s:
        return None
    if not rule.confused:
        if rule.low <= value <= rule.high:
            return None
        text = rule.text.format(value=value, rate=seen.rate_hz, motion=seen.motion_hz)
        return Broken(rule, value, text)
    quantity = QUANTITIES[rule.quantity]
    units = (quantity.usual[0], quantity.confused)
    in_si = [factor(unit, rule.quantity) or 1.0 for unit in units]
    stated = sizes.get(rule.quantity, 0.0)
    is_unit = [math.isclose(stated, size, rel_tol=1e-3) for size in in_si]
    if not any(is_unit) or (value <= rule.high if is_unit[0] else rule.low <= value):
        return None
    ratio = in_si[1] / in_si[0] if is_unit[0] else in_si[0] / in_si[1]
    size, other = rule.text.split()[is_unit[1]], units[is_unit[0]]
    si = "N·m" if rule.quantity == "torque" else "rad/s"
    return Broken(
        rule,
        value,
        f"{value:.3g} {si} is unusually {size}; in {other} it is {value * ratio:.3g} {si}",
    )


def is_reaction(seen: Seen) -> bool:
    """Whether J, B and K are negative: the torque is the joint's reaction, or the angle reversed.

    A joint that is not passive may have one negative value, or two.
    """
    return (
        seen.fit is not None
        and seen.duration_s >= SHORTEST_S
        and bool(np.all(seen.fit.signs < 0))
        and seen.fit.r_squared > _CLEAR_R_SQUARED
    )


def is_exchanged(seen: Seen) -> bool:
    """Whether the angle is explained by the torque as a torque is by the motion, and far better."""
    if seen.fit is None or seen.swapped is None or seen.duration_s < SHORTEST_S:
        return False
    return _better(seen.swapped, seen.fit)


def _better(swapped: RoughFit, fit: RoughFit) -> bool:
    one_sign = abs(float(np.sum(swapped.signs))) == 3.0
    much = 1.0 - swapped.r_squared < _MUCH * (1.0 - fit.r_squared)
    return one_sign and much and swapped.r_squared > _CLEAR_R_SQUARED
