"""Why epochs of an exported session do not count."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def exclusion_reasons(about: Mapping[str, Any]) -> dict[str, str]:
    """Return why epochs do not count, by label: as they ended, or as the estimation found."""
    estimates = about.get("estimates") or {}
    results = [*estimates.get("epochs", ()), *estimates.get("scores", ())]
    found = [(each["epoch"], each) for each in results]
    found += [(each["label"], each) for each in about["epochs"]]
    return {
        name: str(each["reason"]) or str(each["outcome"])
        for name, each in found
        if each["outcome"] != "included"
    }
