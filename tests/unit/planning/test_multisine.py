"""Lines, peak and crest factor of the multisine, and its precision beside the PRBS."""

import math

import numpy as np
import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import (
    compare_multisine,
    crest_factor,
    design,
    multisine_nm,
    multisine_phases_rad,
    prbs_nm,
    predicted_precision,
)


def test_crest_factors_of_known_signals() -> None:
    time = np.arange(1000) / 1000.0
    assert crest_factor(np.sin(2 * np.pi * 5 * time)) == pytest.approx(math.sqrt(2.0), rel=1e-4)
    assert crest_factor(np.sign(np.sin(2 * np.pi * 5 * time + 0.1))) == 1.0


@pytest.mark.parametrize("phases", ["schroeder", "random"])
def test_its_lines_are_equal_and_all_in_the_band(phases: str) -> None:
    settings = parse_settings({"multisine": {"phases": phases, "period_s": 10.0}})
    torque = multisine_nm(settings)
    assert torque.size == 20_000
    assert np.max(np.abs(torque)) == pytest.approx(settings.prbs.amplitude_nm)
    assert np.mean(torque) == pytest.approx(0.0, abs=1e-12)
    lines = np.abs(np.fft.rfft(torque))
    frequency = np.fft.rfftfreq(torque.size, 1e-3)
    wanted = np.isin(np.round(frequency * 20), np.arange(4, 202, 2))  # 0.2, 0.3 … 10 Hz
    assert np.ptp(lines[wanted]) < 1e-6 * np.max(lines)
    assert np.max(lines[~wanted]) < 1e-6 * np.max(lines)


def test_clipping_lowers_the_crest_factor() -> None:
    def crest(steps: int, **tables) -> float:
        return crest_factor(
            multisine_nm(parse_settings({"multisine": {"crest_steps": steps, **tables}}))
        )

    assert crest(200) < 1.55 < crest(0) < 1.9
    assert crest(200, phases="random") < 1.8 < 2.5 < crest(0, phases="random")


def test_random_phases_come_from_the_seed() -> None:
    one, same, other = (
        multisine_nm(parse_settings({"seed": seed, "multisine": {"phases": "random"}}))
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_schroeders_phases() -> None:
    phases = multisine_phases_rad(3, 6, 0)
    np.testing.assert_allclose(phases, -np.pi * np.array([0, 2, 6, 12]) / 4)


def test_a_part_of_a_period_has_no_mean_left() -> None:
    torque = multisine_nm(parse_settings({"multisine": {"period_s": 13.0}}))
    assert np.mean(torque) == pytest.approx(0.0, abs=1e-12)


def test_periods_that_do_not_fit_are_refused() -> None:
    with pytest.raises(UserError, match=r"multisine\.period_s = 25 s is longer than prbs\.durat"):
        multisine_nm(parse_settings({"multisine": {"period_s": 25.0}}))
    narrow = {"wanted_low_hz": 0.15, "wanted_high_hz": 0.2}
    with pytest.raises(UserError, match=r"puts no line into the wanted band 0\.15 to 0\.2 Hz"):
        multisine_nm(parse_settings({"prbs": narrow, "multisine": {"period_s": 3.0}}))


def test_its_period_is_that_of_a_short_epoch() -> None:
    found = design(prbs={"duration_s": 5.0}, with_multisine=True).multisine
    assert found is not None
    lines = np.abs(np.fft.rfft(found.torque_nm)) / found.torque_nm.size  # every 0.2 Hz
    strong = np.flatnonzero(lines > 0.5 * lines.max())
    assert strong.tolist() == list(range(1, 51))  # 0.2 to 10 Hz


def test_an_epoch_too_short_for_a_standard_error_is_a_remark() -> None:
    found = design(prbs={"duration_s": 2.0}, with_multisine=True)
    assert found.multisine is None
    assert "no standard errors, since" in found.remarks[0]


def test_what_it_cannot_be_made_of_is_refused_before_the_search() -> None:
    done: list[float] = []
    with pytest.raises(UserError, match=r"multisine\.period_s = 25 s"):
        design(
            multisine={"period_s": 25.0},
            with_multisine=True,
            search="minimax",
            optimise={"clocks": 2, "bits_low": 7, "bits_high": 7},
            progress=done.append,
        )
    assert not done


def test_the_multisine_beside_the_prbs() -> None:
    settings = Settings()
    torque = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    ours = predicted_precision(torque, settings, settings.subject["OFF"])
    found = compare_multisine(settings, torque, {"OFF": ours})
    assert 1.4 < found.crest_factor < 1.6
    its = predicted_precision(found.torque_nm, settings, settings.subject["OFF"])
    errors = found.errors["OFF"]
    assert errors["prbs"] == ours.iv.free
    # Its peak is the amplitude; the PRBS's is that less its mean.
    np.testing.assert_allclose(errors["same_peak_torque"], its.iv.free, rtol=0.02)
    np.testing.assert_allclose(
        errors["same_angle_sd"],
        np.array(its.iv.free) * its.angle_sd_rad / ours.angle_sd_rad,
    )
    np.testing.assert_allclose(
        errors["same_peak_angle"],
        np.array(its.iv.free) * its.peak_angle_rad / ours.peak_angle_rad,
    )
