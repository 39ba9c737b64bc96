"""Each check on an epoch that is sound, and on one in which what it looks for was put."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from rigidimeter.dynamics import Loop
from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.estimation import Signals, epoch_signals, fit_inertia_damping_stiffness
from rigidimeter.estimation.bandlimited import BANDLIMITED
from rigidimeter.estimation.diagnostics import (
    CHECKS,
    Case,
    Check,
    at_most,
    channel_checks,
    diagnose,
    excitation_checks,
    fit_checks,
    movement_checks,
    reconstructed_torque_nm,
)
from rigidimeter.estimation.diagnostics.movement_checks import active_seconds, emg_envelope_v
from rigidimeter.records import Channel, Epoch
from rigidimeter.settings import (
    ControllerSettings,
    DiagnosticLevels,
    DiagnosticsSettings,
    EstimationSettings,
    RigSettings,
)

SETTINGS = DiagnosticsSettings()
LOOP = Loop(ControllerSettings(), RigSettings())
TRUTH = np.array([0.0045, 0.1368, 1.751])
RATE_HZ, N = 200.0, 4000
T = np.arange(N) / RATE_HZ


def judged(function):
    """Return a check that says what was found, of a function that says what was seen."""
    (check,) = (check for check in CHECKS if check.name == function.__name__)

    def found(*arguments, settings=SETTINGS):
        return check.finding(function(*arguments), settings)

    return found


active_movement = judged(movement_checks.active_movement)
band_share = judged(excitation_checks.band_share)
coherence = judged(excitation_checks.coherence)
conditioning = judged(excitation_checks.conditioning)
emg_activity = judged(movement_checks.emg_activity)
frozen = judged(channel_checks.frozen)
guard_limited = judged(channel_checks.guard_limited)
held_out_vaf = judged(fit_checks.held_out_vaf)
implausible_parameters = judged(fit_checks.implausible_parameters)
imposed_sinusoid = judged(excitation_checks.imposed_sinusoid)
negative_parameters = judged(fit_checks.negative_parameters)
position_limit = judged(channel_checks.position_limit)
residual_perturbation = judged(fit_checks.residual_perturbation)
residual_whiteness = judged(fit_checks.residual_whiteness)
saturation = judged(channel_checks.saturation)
voluntary_torque = judged(movement_checks.voluntary_torque)


def perturbed(seed=0, noise_nm=0.005, voluntary_nm=0.0):
    """Return the joint of the paper in its loop, driven by random binary torque, as an epoch."""
    rng = np.random.default_rng(seed)
    chips = np.repeat(rng.choice([-1.0, 1.0], N // 10), 10)
    own = np.zeros(N)
    if voluntary_nm:
        band = signal.butter(2, [0.3, 4.0], "bandpass", fs=RATE_HZ, output="sos")
        own = signal.sosfilt(band, rng.standard_normal(N + 2000))[2000:]
        own *= voluntary_nm / np.std(own)
    J, B, K = 0.0458 + TRUTH[0], 1.604 + TRUTH[1], TRUTH[2]
    drive = chips + own
    loop = signal.cont2discrete(
        (
            np.array([[0.0, 1.0], [-K / J, -B / J]]),
            np.array([[0.0], [1.0 / J]]),
            np.eye(2),
            np.zeros((2, 1)),
        ),
        1 / RATE_HZ,
    )
    state, motion = np.zeros(2), np.empty((N, 2))
    for k in range(N):
        motion[k] = state
        state = loop[0] @ state + loop[1][:, 0] * drive[k]
    x, v = motion.T
    # Between the edges of the chips the acceleration jumps; its mean over them is the fair one.
    acceleration = (drive - B * v - K * x) / J
    torque = JointDynamics(*TRUTH).torque_nm(x, v, acceleration) - own
    channels = {
        "torque_nm": torque + noise_nm * rng.standard_normal(N),
        "angle_rad": x,
        "velocity_rad_s": v + 1e-4 * rng.standard_normal(N),
        "perturbation_nm": chips,
    }
    channels["angle_rad"] = x + 1e-6 * rng.standard_normal(N)
    return Epoch("file", "1", {name: Channel(name, T, values) for name, values in channels.items()})


def fitted(epoch):
    signals = epoch_signals(epoch, "bandlimited", EstimationSettings())
    return signals, fit_inertia_damping_stiffness(signals).value


@pytest.fixture(scope="module")
def sound():
    epoch = perturbed()
    return epoch, *fitted(epoch)


@pytest.fixture(scope="module")
def pushed():
    epoch = perturbed(voluntary_nm=0.3)
    return epoch, *fitted(epoch)


def with_channel(epoch, name, values):
    return replace(epoch, channels={**epoch.channels, name: Channel(name, T, values)})


def passed(finding):
    return finding.level == "note" and finding.remedy == ""


def assert_failed(finding, *words):
    assert finding.remedy
    assert finding.level == getattr(SETTINGS.levels, finding.name)
    for word in words:
        assert word in finding.text


def test_a_sound_epoch_passes_every_check(sound):
    findings = diagnose(Case(*sound, SETTINGS, np.zeros(N), 1.0))
    assert [finding for finding in findings if not passed(finding)] == []
    assert len(findings) > 12


def test_every_level_that_can_be_set_belongs_to_a_check(sound):
    epoch, signals, parameters = sound
    emg = with_channel(epoch, "emg_v", 1e-5 * np.random.default_rng(1).standard_normal(N))
    case = Case(
        with_channel(emg, "velocity_command_rad_s", emg.channels["velocity_rad_s"].values),
        signals,
        parameters,
        SETTINGS,
        np.zeros(N),
        1.0,
        fit=fit_inertia_damping_stiffness(signals),
        method=BANDLIMITED,
        loop=LOOP,
        unbiased=TRUTH,
    )
    findings = diagnose(case)
    names = [finding.name for finding in findings]
    # What is found where epochs are fitted; what varies within one, and terms that are missing, are
    # looked for in a prepared epoch (test_varying, test_missing_term).
    varying = [name for name in DiagnosticLevels.model_fields if name.startswith("varying_")]
    of_fits = ["lack_of_fit", "between_samples", "missing_term", *varying]
    assert sorted([*names, *of_fits]) == sorted(DiagnosticLevels.model_fields)


def test_what_was_not_recorded_is_not_checked(sound):
    epoch, signals, parameters = sound
    bare = replace(epoch, channels={n: epoch.channels[n] for n in ("torque_nm", "angle_rad")})
    names = {finding.name for finding in diagnose(Case(bare, signals, parameters, SETTINGS))}
    assert not names & {
        "coherence", "residual_perturbation", "emg_activity", "guard_limited", "position_limit",
    }  # fmt: skip


def narrow(low_hz, high_hz):
    """Return a periodic motion of all lines between two frequencies, its derivatives by the DFT."""
    rng = np.random.default_rng(3)
    f = np.fft.rfftfreq(N, 1 / RATE_HZ)
    x = np.exp(2j * np.pi * rng.uniform(size=f.size)) * ((f >= low_hz) & (f <= high_hz))
    w = 2j * np.pi * f
    x, v, a = (np.fft.irfft(x * w**k, N) for k in range(3))
    return Signals(T, JointDynamics(*TRUTH).torque_nm(x, v, a), a, v, x, RATE_HZ, (0.15, 10.0))


def test_a_narrow_motion_cannot_tell_inertia_from_stiffness():
    finding = conditioning(narrow(1.95, 2.05), SETTINGS)
    assert_failed(finding, "cannot distinguish J from K", "90 % of the velocity's power", "Hz")
    low, high = (float(part) for part in finding.text.split("between ")[1][:-3].split(" and "))
    assert 1.8 < low < 2.0 < high < 2.2
    assert passed(conditioning(narrow(0.2, 8.0), SETTINGS))


def test_a_push_in_one_direction_cannot_tell_damping_from_stiffness():
    signals = narrow(0.2, 8.0)
    away = replace(signals, velocity_rad_s=np.exp(T / 5), angle_rad=5 * np.exp(T / 5) + 1e-3 * T)
    assert_failed(conditioning(away, SETTINGS), "cannot distinguish B from K")


def test_a_joint_that_did_not_move_is_told(sound):
    still = replace(sound[1], angle_rad=np.zeros_like(sound[1].angle_rad))
    finding = conditioning(still, SETTINGS)
    assert_failed(finding, "did not move")
    assert math.isinf(finding.value)


def test_coherence_is_the_share_that_follows(sound, pushed):
    assert coherence(*sound[:2], SETTINGS).value > 0.9
    assert coherence(*pushed[:2], SETTINGS).value < coherence(*sound[:2], SETTINGS).value
    epoch, signals, _ = sound
    other = perturbed(seed=5).channels["perturbation_nm"].values
    finding = coherence(with_channel(epoch, "perturbation_nm", other), signals, SETTINGS)
    assert_failed(finding, "follows the perturbation")
    assert finding.value < 0.35


def test_drift_below_the_band_is_told(sound):
    epoch, signals, _ = sound
    drifting = epoch.channels["torque_nm"].values + 3.0 * np.sin(2 * np.pi * 0.05 * T)
    assert_failed(band_share(with_channel(epoch, "torque_nm", drifting), signals, SETTINGS),
                  "the torque's power lies in the band")  # fmt: skip
    assert passed(band_share(epoch, signals, SETTINGS))


def test_an_imposed_sinusoid_is_no_prbs(sound):
    epoch = sound[0]
    x = 0.3 * np.sin(2 * np.pi * T)
    sine = replace(epoch, channels={"torque_nm": Channel("torque_nm", T, x),
                                    "angle_rad": Channel("angle_rad", T, x)})  # fmt: skip
    assert_failed(imposed_sinusoid(sine, SETTINGS), "the motion is a sinusoid")
    assert passed(imposed_sinusoid(epoch, SETTINGS))


def test_white_in_the_band_is_flat_and_tremor_is_not(sound):
    signals = sound[1]
    rng = np.random.default_rng(6)
    n = signals.time_s.size
    flat = [residual_whiteness(rng.standard_normal(n), signals, SETTINGS).value for _ in range(40)]
    assert min(flat) > 0.85
    assert 0.97 < np.mean(flat) <= 1.0
    tremor = rng.standard_normal(n) + 3.0 * np.sin(2 * np.pi * 5.0 * signals.time_s)
    assert_failed(residual_whiteness(tremor, signals, SETTINGS), "coloured")
    assert_failed(residual_whiteness(np.zeros(n), signals, SETTINGS))


def test_a_delay_that_the_model_lacks_follows_the_perturbation(sound):
    epoch, signals, parameters = sound
    residual = -reconstructed_torque_nm(signals, parameters)
    assert passed(residual_perturbation(epoch, residual, signals, SETTINGS))
    late = with_channel(epoch, "torque_nm", np.roll(epoch.channels["torque_nm"].values, 6))
    signals, parameters = fitted(late)
    residual = -reconstructed_torque_nm(signals, parameters)
    assert_failed(residual_perturbation(late, residual, signals, SETTINGS), "the model lacks")


def test_the_lag_of_what_is_left_over_is_told(sound):
    epoch, signals, _ = sound
    rate = signals.rate_hz
    cause = np.interp(signals.time_s - 0.2, T, epoch.channels["perturbation_nm"].values)
    finding = residual_perturbation(epoch, cause, signals, SETTINGS)
    lag_s = float(finding.text.split("lag of ")[1].split(" s")[0])
    assert lag_s == pytest.approx(0.2, abs=2 / rate)


def test_what_does_not_last_is_not_foreseen(sound):
    signals = sound[1]
    assert held_out_vaf(signals, SETTINGS).value > 95.0
    half = signals.time_s.size // 2
    turned = np.concatenate([signals.torque_nm[:half], -signals.torque_nm[half:]])
    finding = held_out_vaf(replace(signals, torque_nm=turned), SETTINGS)
    assert_failed(finding, "explain")
    assert finding.value == pytest.approx(-300.0, rel=0.1)  # 1 − var(2 M)/var(M)


def test_the_subjects_torque_comes_back_once_the_joint_is_known(pushed):
    epoch, signals, _ = pushed
    own = reconstructed_torque_nm(signals, TRUTH)
    assert np.std(own) == pytest.approx(0.3, rel=0.15)
    finding = voluntary_torque(own, signals, SETTINGS)
    assert_failed(finding, "N·m")
    sd = math.sqrt(finding.value / 100) * np.std(signals.torque_nm)
    assert sd == pytest.approx(0.3, rel=0.15)
    assert epoch.label == "1"


def test_seconds_of_movement_are_found_where_they_are(sound):
    _, signals, parameters = sound
    own = reconstructed_torque_nm(signals, parameters)
    t = signals.time_s
    own = own + 0.8 * np.sin(2 * np.pi * t) * ((t >= 6.0) & (t < 9.0))
    start_s, sd_nm = active_seconds(own, signals, SETTINGS)
    start_s = start_s.round(6)
    assert np.all(sd_nm[(start_s >= 6.0) & (start_s < 9.0)] > 0.4)
    assert np.all(sd_nm[(start_s < 4.5) | (start_s > 10.5)] < 0.1)
    little = active_movement(own, signals, SETTINGS)
    assert 10.0 < little.value < 35.0
    assert "from 6.0 s, 7.0 s, 8.0 s" in little.text
    assert (
        active_movement(reconstructed_torque_nm(signals, parameters), signals, SETTINGS).value == 0
    )


def test_what_is_much_for_an_elbow_is_little_for_an_ankle(sound):
    signals = sound[1]
    own = 0.5 * np.sin(2 * np.pi * signals.time_s)
    assert active_movement(own, signals, SETTINGS).value > 80.0
    ankle = replace(signals, torque_nm=20 * signals.torque_nm)
    assert active_movement(own, ankle, SETTINGS).value == 0.0


def test_a_muscle_that_fires_is_seen_above_its_own_baseline():
    rng = np.random.default_rng(7)
    burst = (T > 5.0) & (T < 11.0)
    emg = Channel("emg_v", T, rng.standard_normal(N) * np.where(burst, 2e-4, 1e-5) + 0.5)
    finding = emg_activity(emg, SETTINGS)
    assert_failed(finding, "baseline")
    assert finding.value == pytest.approx(30.0, abs=3.0)
    quiet = Channel("emg_v", T, 1e-5 * rng.standard_normal(N))
    assert emg_activity(quiet, SETTINGS).value == 0.0
    # The mean of |e| for Gaussian e is √(2/π) σ.
    assert np.mean(emg_envelope_v(quiet, 0.25)) == pytest.approx(
        1e-5 * math.sqrt(2 / math.pi), rel=0.05
    )


def test_a_clipped_channel_is_excluded(sound):
    epoch = sound[0]
    torque = epoch.channels["torque_nm"].values
    clipped = np.clip(torque, -0.6 * np.max(torque), 0.6 * np.max(torque))
    finding = saturation(with_channel(epoch, "torque_nm", clipped), SETTINGS)
    assert_failed(finding, "torque_nm repeats its extreme values")
    assert finding.level == "exclude"
    assert saturation(epoch, SETTINGS).value == 0.0


def test_a_sensor_that_hung_is_excluded_and_the_place_is_told(sound):
    epoch = sound[0]
    velocity = epoch.channels["velocity_rad_s"].values.copy()
    velocity[1000:1101] = velocity[1000]
    finding = frozen(with_channel(epoch, "velocity_rad_s", velocity), SETTINGS)
    assert_failed(finding, "velocity_rad_s", "from 5 s")
    assert finding.value == pytest.approx(0.5)
    assert finding.level == "exclude"


def test_the_guard_and_the_position_limit_are_counted(sound):
    limited = np.zeros(1000)
    limited[:50] = 2
    assert guard_limited(limited, SETTINGS).value == pytest.approx(5.0)
    assert_failed(guard_limited(limited, SETTINGS), "5 % of the commands")
    angle = Channel("angle_rad", T, 0.5 * np.sin(T))
    assert_failed(position_limit(angle, 0.5, SETTINGS), "100 % of the position limit of 28.6 deg")
    assert passed(position_limit(angle, 0.7, SETTINGS))


def test_negative_parameters_are_named_with_what_is_likely():
    assert passed(negative_parameters(TRUTH))
    one = negative_parameters((0.0045, -0.1, 1.7))
    assert_failed(one, "B is not above zero")
    turned = negative_parameters((-0.0045, -0.1, -1.7))
    assert_failed(turned, "J and B and K", "sign of the joint's reaction")
    assert "--reaction" in turned.remedy
    assert negative_parameters((math.nan, 1.0, 1.0)).value == 1.0


@pytest.mark.parametrize(
    ("parameters", "words", "factor"),
    [
        ((5.0, 0.1, 1.0), "J = 5 kg·m² is large", 5.0),
        ((1e-6, 0.1, 1.0), "J = 1e-06 kg·m² is small", 10.0),
        ((0.01, 100.0, 1.0), "B = 100 N·m·s/rad is large", 2.0),
        ((0.01, 0.1, 6000.0), "K = 6e+03 N·m/rad is large", 3.0),
    ],
)
def test_sizes_that_no_joint_has_are_told(parameters, words, factor):
    finding = implausible_parameters(parameters, SETTINGS)
    assert_failed(finding, words)
    assert finding.value == pytest.approx(factor)


def test_a_level_is_what_the_settings_say():
    levels = DiagnosticLevels(negative_parameters="exclude")
    settings = DiagnosticsSettings(levels=levels)
    assert negative_parameters((1.0, -1.0, 1.0), settings=settings).level == "exclude"


def test_a_subject_who_pushes_raises_doubt(pushed):
    found = {f.name: f.level for f in diagnose(Case(*pushed, SETTINGS))}
    assert found["voluntary_torque"] == "doubt"
    assert found["active_movement"] == "doubt"
    assert found["frozen"] == found["saturation"] == "note"


def test_a_check_from_outside_is_one_entry(sound):
    def loud(case):
        peak_nm = float(np.max(np.abs(case.epoch.channels["torque_nm"].values)))
        return at_most(peak_nm, 0.01, f"the torque reaches {peak_nm:.1f} N·m")

    toy = Check("loud", ("torque_nm",), loud, "that is much", "push less")
    never = Check("never", ("emg_v",), loud, "", "")
    CHECKS.extend([toy, never])
    try:
        found = {f.name: f for f in diagnose(Case(*sound, SETTINGS))}
    finally:
        del CHECKS[-2:]
    assert (found["loud"].level, found["loud"].remedy) == ("doubt", "push less")
    assert found["loud"].text.endswith("N·m: that is much")
    assert "never" not in found
