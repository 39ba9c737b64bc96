"""The lever arm of a force, where a file states it, as in ``Lever arm: 0.25 m``."""

from __future__ import annotations

import re
from collections.abc import Mapping

_LENGTH = r"(mm|cm|m|inch|in)(?![a-z])"
_STATED = re.compile(
    r"(?i)(?<![a-z])(?:(?:lever|moment)[\s_-]*arm|hebel(?:arm|länge)?|bras de levier"
    r"|braccio(?: di leva)?|brazo(?: de palanca)?|hefboom(?:sarm)?)(?![a-z])"
    rf"(?:[\s_]*[\[(_]\s*{_LENGTH}\s*[\])]?)?[^\w\n]*(\d+(?:[.,]\d+)?)\s*(?:{_LENGTH})?"
)


def states_lever_arm(text: str) -> bool:
    """Whether a text states a lever arm with its unit."""
    return bool(_found(text))


def lever_arm(stated: Mapping[str, float | str]) -> str:
    """Return the one lever arm that single values and lines of a head state, as ``0.25 m``.

    Parameters
    ----------
    stated : mapping of str to float or str
        By name, such as ``lever_arm_m``.
    """
    found = {one for name, value in stated.items() for one in _found(f"{name} {value}")}
    return found.pop() if len(found) == 1 else ""


def _found(text: str) -> set[str]:
    return {
        f"{number.replace(',', '.')} {behind or before}"
        for before, number, behind in _STATED.findall(text)
        if (behind or before) and (not behind or not before or behind == before)
    }
