"""The search for a PRBS: amplitudes at the guard's limits, criteria, ranking."""

import numpy as np
import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model import closed_loop_motion, median_joint
from rigidimeter.planning import (
    CRITERIA,
    assess,
    demand,
    optimise,
    prbs_nm,
    predicted_precision,
    strongest_amplitude_nm,
)

SMALL = {"bits_low": 6, "bits_high": 7, "clocks": 3, "clock_low_hz": 10.0, "clock_high_hz": 40.0}
ONE_JOINT = {"OFF": {"voluntary_sd_nm": 0.05}}


def search(**optimise_table) -> Settings:
    return parse_settings({"subject": ONE_JOINT, "optimise": {**SMALL, **optimise_table}})


def test_the_criteria_of_independent_errors() -> None:
    relative = np.diag([1.0, 4.0, 16.0])  # errors of 1, 2 and 4 %
    assert CRITERIA["minimax"](relative) == 4.0
    assert CRITERIA["A"](relative) == pytest.approx(np.sqrt(7.0))
    assert CRITERIA["D"](relative) == pytest.approx(2.0)


@pytest.mark.parametrize("criterion", list(CRITERIA))
def test_sequences_are_ranked_by_the_criterion(criterion: str) -> None:
    ranked = optimise(search(), criterion)
    assert [(c.prbs.register_bits, c.prbs.clock_hz) for c in ranked].count((7, 20.0)) == 1
    assert len(ranked) == 6
    order = [(not candidate.covered, candidate.cost_percent) for candidate in ranked]
    assert order == sorted(order)
    assert {candidate.covered for candidate in ranked} == {True, False}


def test_its_errors_are_those_of_the_sequence_it_names() -> None:
    settings = search()
    best = optimise(settings)[0]
    found = predicted_precision(prbs_nm(best.prbs, 1000.0), settings, settings.subject["OFF"])
    expected = 100.0 * np.array(found.iv.free) / found.values
    np.testing.assert_allclose(best.errors_percent["OFF"], expected, rtol=1e-9)
    assert best.cost_percent == pytest.approx(np.max(expected))
    assert best.peak_angle_rad == pytest.approx(found.peak_angle_rad)
    assert best.angle_sd_rad == pytest.approx(found.angle_sd_rad)


@pytest.mark.parametrize(
    ("guard", "quantity", "limit"),
    [
        ({"position_limit_deg": 21.0}, "reach_rad", 21.0),
        ({"speed_limit_deg_s": 50.0}, "peak_speed_rad_s", 50.0),
        ({"acceleration_limit_deg_s2": 3000.0}, "peak_acceleration_rad_s2", 3000.0),
    ],
)
def test_the_amplitude_is_at_the_limit_less_the_margin(guard, quantity, limit) -> None:
    settings = parse_settings({"guard": guard, "optimise": {"limit_margin_percent": 10.0}})
    motion = closed_loop_motion(
        prbs_nm(settings.prbs, 1000.0), settings, median_joint(settings.subject["OFF"])
    )
    amplitude = strongest_amplitude_nm([(motion, 0.0, 0.0)], settings)
    needs = demand(
        amplitude * motion.angle_rad, amplitude * motion.command_rad_s, 1000.0, settings.guard
    )
    assert 0.0 < amplitude < settings.optimise.amplitude_high_nm
    assert getattr(needs, quantity) == pytest.approx(0.9 * rad_from_deg(limit))


def test_room_is_left_for_what_the_subject_does() -> None:
    settings = parse_settings({"guard": {"position_limit_deg": 21.0}})
    motion = closed_loop_motion(
        prbs_nm(settings.prbs, 1000.0), settings, median_joint(settings.subject["OFF"])
    )
    alone = strongest_amplitude_nm([(motion, 0.0, 0.0)], settings)
    moving = strongest_amplitude_nm([(motion, 0.02, 0.0)], settings)
    assert 0.0 < moving < alone
    assert strongest_amplitude_nm([(motion, 1.0, 0.0)], settings) == 0.0


def test_amplitude_is_held_to_the_highest_wanted() -> None:
    assert {c.prbs.amplitude_nm for c in optimise(search(amplitude_high_nm=0.2))} == {0.2}


def test_the_settings_own_sequence_is_assessed_as_it_is() -> None:
    settings = Settings()
    found = assess(settings)
    assert found is not None
    assert found.prbs == settings.prbs
    assert found.covered
    torque = prbs_nm(settings.prbs, 1000.0)
    ours = [predicted_precision(torque, settings, subject) for subject in settings.subject.values()]
    worst = max(np.max(np.array(one.iv.free) / one.values) for one in ours)
    assert found.cost_percent == pytest.approx(100.0 * worst)


def test_what_cannot_be_searched_is_said() -> None:
    with pytest.raises(UserError, match="'E' is unknown; it must be one of minimax, A, D"):
        optimise(Settings(), "E")
    with pytest.raises(UserError, match=r"subject\.OFF has a damping or stiffness of 0"):
        optimise(parse_settings({"subject": {"OFF": {"stiffness_nm_rad": 0.0}}}))
    tight = {"position_limit_deg": 21.0}
    subject = {"OFF": {"voluntary_sd_nm": 5.0}}
    with pytest.raises(UserError, match=r"no sequence within \[optimise\] stays within the guard"):
        optimise(parse_settings({"guard": tight, "subject": subject, "optimise": SMALL}))
    with pytest.raises(UserError, match="clock_low_hz must not be above clock_high_hz"):
        search(clock_low_hz=50.0)
    with pytest.raises(UserError, match="bits_low must not be above bits_high"):
        search(bits_low=9)
