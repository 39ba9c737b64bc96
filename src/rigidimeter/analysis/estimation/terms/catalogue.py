"""The terms of the equation, by name.

    M = sum of coefficient × term(angle, velocity, acceleration) + residual

A coefficient is positive where the term resists the motion: a friction that opposes, a spring that
pulls back, a reflex in the muscle that is stretched. `damping-` is therefore min(v, 0), and
`coulomb-` is −1 where v < 0.

References: inertia, damping and stiffness, Eq. 3; Coulomb friction, with a value for each
direction, Janot, Gautier and Brunot (EMPS benchmark);
damping and stiffness for each direction, Park et al.
2011; cubic stiffness, Wigren and Schoukens 2013 (the Duffing equation); reflex, Mirbagheri, Barbeau
and Kearney 2000.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.terms.reflex import REFLEX_KINDS
from rigidimeter.core.errors import UserError


@dataclass(frozen=True)
class Term:
    """A regressor with one coefficient.

    Attributes
    ----------
    name : str
    unit : str
        Of the coefficient, in N·m for the torque and rad for the angle.
    meaning : str
        What it is, in one sentence.
    regressor : callable
        From wide-band signals to an array of shape (n,).
    resists : bool
        Whether a negative coefficient would push: it is then something else than the term.
    """

    name: str
    unit: str
    meaning: str
    regressor: Callable[[Signals], Array]
    resists: bool = False


def _toward_each_side(
    name: str,
    unit: str,
    torque: str,
    regressor: Callable[[Signals, float], Array | float],
    *,
    resists: bool = False,
) -> list[Term]:
    """Return a term for motion toward positive angle, and one for the other."""

    def toward(sign: float) -> Callable[[Signals], Array]:
        return lambda m: np.where(sign * m.velocity_rad_s > 0, regressor(m, sign), 0.0)

    return [
        Term(name + mark, unit, f"{torque} while it moves toward {side} angle.", made, resists)
        for mark, side, made in (("+", "positive", toward(1.0)), ("-", "negative", toward(-1.0)))
    ]


TERMS: list[Term] = [
    Term(
        "inertia", "kg·m²", "Torque for each angular acceleration.", lambda m: m.acceleration_rad_s2
    ),
    Term(
        "damping", "N·m·s/rad", "Viscous torque, as fast as it moves.", lambda m: m.velocity_rad_s
    ),
    Term("stiffness", "N·m/rad", "Elastic torque, as far as it is.", lambda m: m.angle_rad),
    Term("offset", "N·m", "A constant torque.", lambda m: np.ones_like(m.angle_rad)),
    Term(
        "coulomb",
        "N·m",
        "Dry friction: the same at any speed, against it.",
        lambda m: np.sign(m.velocity_rad_s),
        resists=True,
    ),
    Term(
        "quadratic",
        "N·m/rad²",
        "Stiffness that grows with the angle, so that the two sides differ.",
        lambda m: m.angle_rad**2,
    ),
    Term(
        "cubic",
        "N·m/rad³",
        "Stiffness that grows with the square of the angle.",
        lambda m: m.angle_rad * m.angle_rad**2,
    ),
    *_toward_each_side("damping", "N·m·s/rad", "Viscous torque", lambda m, sign: m.velocity_rad_s),
    *_toward_each_side("stiffness", "N·m/rad", "Elastic torque", lambda m, sign: m.angle_rad),
    *_toward_each_side("coulomb", "N·m", "Dry friction", lambda m, sign: sign, resists=True),
]
"""Terms that are linear in their coefficient. Code from outside the package may append its own."""

REFLEXES: tuple[str, ...] = tuple(kind + side for kind in REFLEX_KINDS for side in ("", "+", "-"))
"""Reflex paths. `+` has the muscle stretched by motion toward positive angle, `-` the other;
without a sign both are tried, and the data decide."""

GROUPS: Mapping[str, tuple[str, ...]] = {
    "directional-damping": ("damping+", "damping-"),
    "directional-stiffness": ("stiffness+", "stiffness-"),
    "directional-coulomb": ("coulomb+", "coulomb-"),
}
"""Names for several terms together."""


def term_named(name: str) -> Term | None:
    """Return the linear term of that name; None where there is none."""
    return next((term for term in TERMS if term.name == name), None)


def term_names() -> tuple[str, ...]:
    """Return what `--terms` takes; a reflex may be followed by a direction."""
    return (*(term.name for term in TERMS), *GROUPS, *REFLEX_KINDS)


def parse_terms(text: str | Iterable[str]) -> tuple[str, ...]:
    """Return the terms that a comma-separated text, or a sequence of names, asks for.

    Raises
    ------
    UserError
        If a name is unknown or given twice, or there is none.
    """
    given = text.split(",") if isinstance(text, str) else list(text)
    names = [name.strip() for name in given if name.strip()]
    if not names:
        raise UserError("no term is named; for example inertia,damping,stiffness")
    where = f"{','.join(names)}: " if len(names) > 1 else ""
    linear = [term.name for term in TERMS]
    found: list[str] = []
    for name in names:
        for single in GROUPS.get(name, (name,)):
            if single.startswith("reflex") and single not in REFLEXES:
                raise UserError(
                    f"{where}there is no term {single!r}; a reflex is one of "
                    f"{', '.join(REFLEX_KINDS)}, followed by + or - for the direction of motion "
                    "that stretches the muscle, or by nothing to let the data decide"
                )
            if single not in linear and single not in REFLEXES:
                known = ", ".join(term_names())
                raise UserError(f"{where}there is no term {single!r}; known: {known}")
            if single in found:
                raise UserError(f"{where}{single} is named twice; name each term once")
            found.append(single)
    kinds = [name.rstrip("+-") for name in found if name in REFLEXES]
    signs = [name[-1] for name in found if name in REFLEXES and name[-1] in "+-"]
    if len(kinds) > 2 or (len(kinds) == 2 and (len(signs) < 2 or signs[0] == signs[1])):
        raise UserError(
            f"{where}one reflex fits each direction; name one reflex, or one with + and one with -"
        )
    return tuple(found)
