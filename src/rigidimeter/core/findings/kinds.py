"""Every kind of finding by its name. Code from outside the package may add its own."""

from __future__ import annotations

from rigidimeter.core.findings.kind import Kind, Level
from rigidimeter.core.findings.kinds_of_fit import FIT_KINDS
from rigidimeter.core.findings.kinds_of_joint import JOINT_KINDS
from rigidimeter.core.findings.kinds_of_model import MODEL_KINDS
from rigidimeter.core.findings.kinds_of_sensors import SENSOR_KINDS
from rigidimeter.core.findings.kinds_of_study import STUDY_KINDS

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (*SENSOR_KINDS, *FIT_KINDS, *MODEL_KINDS, *JOINT_KINDS, *STUDY_KINDS)
}


def default_level(name: str) -> Level:
    """Return what a failure of the check does unless the settings say otherwise."""
    return KINDS[name].level if name in KINDS else "caution"
