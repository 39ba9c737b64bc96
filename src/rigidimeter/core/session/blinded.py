"""Codes in place of the conditions of a session whose examiner must not know them.

They are drawn before the session and are in its manifest (`about.codes`), beside the names: they
keep a condition off screens and pages, not from somebody who opens the files.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from typing import Any

NO_CODE = "(blinded)"
"""What is shown of a condition that has no code where others have one."""


def drawn_codes(conditions: Sequence[str], rng: random.Random) -> dict[str, str]:
    """Return a code for each condition, in an order that the names do not tell.

    Examples
    --------
    >>> sorted(drawn_codes(["OFF", "DBS"], random.Random(1)).values())
    ['code-A', 'code-B']
    """
    names = list(dict.fromkeys(conditions))
    order = rng.sample(range(len(names)), len(names))
    return {name: f"code-{chr(ord('A') + k)}" for name, k in zip(names, order, strict=True)}


def codes_of(about: Mapping[str, Any]) -> dict[str, str]:
    """Return the codes that a manifest's `about` holds; empty where nobody was blinded."""
    codes = about.get("codes")
    return {str(name): str(code) for name, code in codes.items()} if codes else {}
