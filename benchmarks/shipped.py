"""The estimation of the package as it is, for benchmarks that compare it with another.

Such a function takes epochs, settings and the name of a method and returns an `Analysis`. A module
of its own, since what it imports is measured.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence

from rigidimeter.analysis.study import estimate
from rigidimeter.core.records import Analysis, Epoch
from rigidimeter.core.settings import Settings

Estimation = Callable[[Sequence[Epoch], Settings, str], Analysis]
NAME = "benchmarks.shipped:shipped"


def shipped(epochs: Sequence[Epoch], settings: Settings, method: str) -> Analysis:
    """Return the analysis of the package."""
    return estimate(epochs, method, settings=settings)


def named(name: str) -> str:
    """Return the name of a function, of the command line, if there is one of that name."""
    try:
        pkgutil.resolve_name(name)
    except (ImportError, AttributeError) as error:
        raise ValueError(str(error)) from error
    return name
