"""A named scenario: what really is, what the settings say, and the finding that is right for it."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from tests.scenarios.limbs import LIMBS, settings_of, setup_of
from tests.scenarios.recordings import Setup, Simulated, simulate

from rigidimeter.core.settings import Settings, changed_settings


@dataclass(frozen=True)
class Scenario:
    """One row of the table.

    Attributes
    ----------
    name : str
    limb : str
        One of `LIMBS`, whose settings the analysis gets.
    setup : Setup
    findings : tuple of str
        Any of these says what is wrong, by the beginning of its name.
    settings : mapping
        What the settings say beyond those of the limb.
    other_model : bool
        Whether the joint is not one J, B and K: to say so is right even where their means are.
    """

    name: str
    limb: str
    setup: Setup
    findings: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    other_model: bool = False

    def analysed_with(self) -> Settings:
        """Return the settings of the analysis."""
        return changed_settings(settings_of(LIMBS[self.limb]), self.settings)

    def simulated(self, recording: int, n_epochs: int) -> Simulated:
        """Return a recording; its number alone decides what chance does."""
        name = zlib.crc32(self.name.encode())
        return simulate(self.setup, n_epochs, np.random.SeedSequence([name, recording]))


def scenario(
    name: str,
    findings: tuple[str, ...] = (),
    limb: str = "animal elbow",
    settings: Mapping[str, Any] | None = None,
    other_model: bool = False,
    **changes: Any,
) -> Scenario:
    """Return a scenario of a limb at rest on its rig with these changes.

    A mapping among the changes replaces fields of that part of the set-up: ``joint={"coulomb_nm":
    0.1}``.
    """
    setup = setup_of(LIMBS[limb])
    parts: dict[str, Any] = {}
    for part, value in changes.items():
        now = getattr(setup, part)
        if not isinstance(value, Mapping):
            parts[part] = value
        elif hasattr(now, "_replace"):
            parts[part] = now._replace(**value)
        else:
            parts[part] = replace(now, **value)
    return Scenario(name, limb, replace(setup, **parts), findings, settings or {}, other_model)
