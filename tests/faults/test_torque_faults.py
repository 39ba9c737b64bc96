"""A false torque that no other law finds is found by the drive's own, within 1 s."""

import pytest
from benchmarks.drive_torque import settings_of
from tests.faults.torque_faults import FAULTS, Case, ended

from rigidimeter.rig.guard import Cause, DriveModel

SETTINGS = settings_of("small", "pushing 0.5 N·m")
SIDE = SETTINGS.rig.drive_side
CASE = Case(
    "small",
    "",
    SETTINGS,
    DriveModel(
        SIDE.torque_scale, 0.001, SIDE.reflected_inertia_kg_m2, SIDE.friction_nm, 0.0, 0.0, 0.033
    ),
)


@pytest.mark.parametrize(
    "fault", ["stuck, with noise of 0.3 N·m", "gain 3", "offset 1 N·m", "clipped at 0.3 N·m"]
)
def test_a_fault_is_found_within_a_second(fault):
    found = ended(CASE, FAULTS[fault], CASE.model)
    assert found.cause is Cause.TORQUE_DISAGREES
    assert found.after_s < 1.0


def test_without_the_law_it_passes_and_without_a_fault_nothing_is_found():
    assert ended(CASE, FAULTS["offset 1 N·m"], None).cause is Cause.NONE
    assert ended(CASE, None, CASE.model).cause is Cause.NONE
