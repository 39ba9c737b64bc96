"""A design as one value: what it is made from, and what it says."""

from pathlib import Path

import numpy as np
import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import design, prbs_nm, predicted_precision


def test_overview_names_every_condition_of_the_settings() -> None:
    settings = parse_settings({"subject": {"OFF": {}, "levodopa": {}}})
    planned = design(settings)
    assert list(planned.prbs_demand) == ["free arm", "subject OFF", "subject levodopa"]
    assert planned.warnings == ()
    assert not planned.perturbation_nm.flags.writeable


def test_an_unstable_loop_has_no_precision() -> None:
    settings = parse_settings({"controller": {"inertia_kg_m2": 0.0008, "damping_nm_s_rad": 0.028}})
    found = design(settings, search="minimax", with_multisine=True, differences=["damping=20%"])
    assert found.precision == {}
    assert found.remarks[0] == "subject OFF: no standard errors, since the loop is unstable"
    assert found.ranked is found.multisine is None
    assert found.detections == ()
    assert found.table().empty
    assert "is unstable" in found._repr_html_()
    assert "; the loop is unstable; " in repr(found)


def test_a_condition_without_errors_has_a_remark() -> None:
    found = design(prbs={"duration_s": 2.0})
    assert found.precision == {}
    assert "since estimation.trim_s = 1 s at either end leaves nothing" in found.remarks[0]


def test_it_is_made_from_settings_a_file_or_a_mapping(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text("[prbs]\nclock_hz = 10.0\n")
    same = [
        design(path),
        design(str(path)),
        design({"prbs": {"clock_hz": 10.0}}),
        design(prbs={"clock_hz": 10.0}),
        design(Settings(), prbs={"clock_hz": 10.0}),
    ]
    for one in same:
        assert one.settings.prbs.clock_hz == 10.0
        np.testing.assert_array_equal(one.perturbation_nm, same[0].perturbation_nm)
    with pytest.raises(
        UserError, match=r"prbs\.clock is not a setting; the nearest is prbs\.clock_"
    ):
        design(prbs={"clock": 10.0})
    # A change leaves the rest of its table as it was.
    both = design(path, prbs={"register_bits": 8}).settings.prbs
    assert (both.clock_hz, both.register_bits) == (10.0, 8)


def test_its_table_holds_the_predicted_standard_errors() -> None:
    found = design()
    settings = found.settings
    torque = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    expected = predicted_precision(torque, settings, settings.subject["DBS"])
    row = found.table().loc[("DBS", "iv")]
    assert tuple(row) == expected.iv.free
    assert list(row.index) == ["inertia_kg_m2_se", "damping_nm_s_rad_se", "stiffness_nm_rad_se"]
    assert "least_squares" in found._repr_html_()
    assert repr(found).startswith("PRBS of 127 chips at 20 Hz, 1 N·m, 20 s; OFF standard errors")
    assert f"K {expected.iv.free[2]:.2g} N·m/rad" in repr(found)
    assert "\n" not in repr(found)


def test_the_days_needed_are_a_table() -> None:
    found = design(Settings(), differences=["damping=20%", "stiffness=0.01"])
    days = found.days()
    needed = found.detections[0].needed
    assert list(days.loc["damping", "days_needed"]) == [each.days for each in needed]
    assert list(days.loc["damping", "subjects_needed"]) == [each.subjects for each in needed]
    assert days.loc["stiffness"].isna().all(axis=None)  # 0.6 % takes more than 1000 days
    assert "days_needed_alone" in found._repr_html_()
