"""The torque sensor against the drive's own torque, where the answer is known in closed form."""

import math
from typing import NamedTuple

import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.guard import (
    LEAST_SHARE,
    PRESLIDING_RAD,
    SETTLED_S,
    SLIPS_RAD_S,
    TIMES_SCATTER,
    WINDOW_S,
    Cause,
    DriveModel,
    DriveTorqueLimits,
    DriveTorqueState,
    drive_torque_limits,
    drive_torque_state,
    drive_torque_step,
    zeroed,
)

DT = 0.001
SCATTER_NM = 0.025
SHARE = TIMES_SCATTER * LEAST_SHARE
MODEL = DriveModel(0.9, 0.0, 0.05, 0.3, 0.02, 0.1, SCATTER_NM)
SPEED = 0.5
W = 2.0 * math.pi * 5.0


def limits(model=MODEL, tick_hz=1000.0):
    sensors = {"torque": {"rate_hz": tick_hz}, "motion": {"rate_hz": tick_hz}}
    rig = {"tick_rate_hz": tick_hz, "drive_bandwidth_hz": 10.0, **sensors}
    slow = {"guard": {"reaction_time_s": 0.1}, "controller": {"torque_cutoff_hz": 10.0}}
    return drive_torque_limits(parse_settings({"rig": rig, **slow}), model)


class Ran(NamedTuple):
    """After how long which cause was found, and the state."""

    time_s: float
    cause: Cause
    state: DriveTorqueState


class Rig:
    """A drive's side and a sensor as functions of the time; ages are added to the time they show.

    By default the joint goes at a constant velocity and the drive's torque is what the model asks.
    """

    def __init__(self, **changed):
        self.model = MODEL
        self.torque = lambda t: 1.0
        self.angle = lambda t: SPEED * t
        self.velocity = lambda t: SPEED
        self.acceleration = lambda t: 0.0
        self.sensed = lambda t: self.torque(t)
        self.friction = lambda t: math.copysign(self.model.friction_nm, self.velocity(t))
        self.late_s = 0.0
        self.ages_s = (0.0, 0.0, 0.0)
        self.tick_hz = 1000.0
        self.elapsed = lambda k: 1
        for name, value in changed.items():
            setattr(self, name, value)

    def drive(self, t):
        a, _, inertia, _, damping, zero = self.model[:6]
        own = inertia * self.acceleration(t) + self.friction(t) + damping * self.velocity(t)
        return (self.torque(t) - zero + own) / a

    def run(self, duration_s, bounds=None, state=None):
        bounds = bounds or limits(self.model, self.tick_hz)
        state = state or drive_torque_state(bounds)
        torque_s, motion_s, drive_s = self.ages_s
        tick = 0
        while tick < duration_s * self.tick_hz:
            elapsed = self.elapsed(tick)
            tick += elapsed
            t = tick / self.tick_hz
            state, cause = drive_torque_step(
                bounds,
                state,
                self.sensed(t - torque_s),
                torque_s,
                self.angle(t - motion_s),
                self.velocity(t - motion_s),
                motion_s,
                self.drive(t - drive_s - self.late_s),
                drive_s,
                elapsed,
            )
            if cause:
                return Ran(t, Cause(cause), state)
        return Ran(duration_s, Cause.NONE, state)


def swinging(amplitude_rad, frequency_hz, **changed):
    omega = 2.0 * math.pi * frequency_hz
    return Rig(
        angle=lambda t: amplitude_rad * math.sin(omega * t),
        velocity=lambda t: amplitude_rad * omega * math.cos(omega * t),
        acceleration=lambda t: -amplitude_rad * omega**2 * math.sin(omega * t),
        **changed,
    )


def own_nm(ran):
    return SHARE * math.sqrt(ran.state.steps.own_nm2)


# --- size


def test_torques_that_agree_pass_for_ever_and_leave_nothing():
    ran = Rig().run(5.0)
    assert ran.cause is Cause.NONE
    assert ran.state.steps.size_nm == pytest.approx(0.0, abs=1e-9)
    assert ran.state.steps.model_nm2 == pytest.approx(1.0)  # m is the torque of 1 N·m
    assert ran.state.steps.own_nm2 == pytest.approx((0.9 * Rig().drive(0.0)) ** 2)


@pytest.mark.parametrize("offset_nm", [0.05, -0.05])
def test_the_size_of_a_constant_difference_is_that_difference(offset_nm):
    ran = Rig(sensed=lambda t: 1.0 + offset_nm).run(3.0)
    assert ran.cause is Cause.NONE
    assert ran.state.steps.size_nm == pytest.approx(0.05)
    assert ran.state.steps.slope_nm2 == pytest.approx(offset_nm * 1.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_limit_itself_is_allowed_and_more_is_found(sign, direction):
    """4 times the scatter and a fiftieth of the drive's own torque: 0.1 and 0.02 · 1.21 N·m."""

    def offset(nm):
        moved = {"angle": lambda t: direction * SPEED * t, "velocity": lambda t: direction * SPEED}
        return Rig(sensed=lambda t: 1.0 + sign * nm, **moved)

    own = SHARE * 0.9 * abs(offset(0.0).drive(0.0))
    limit_nm = TIMES_SCATTER * SCATTER_NM + own
    assert offset(limit_nm - 1e-6).run(3.0).cause is Cause.NONE
    assert offset(limit_nm + 1e-6).run(3.0).cause is Cause.TORQUE_DISAGREES


@pytest.mark.parametrize(("times", "within_s"), [(1.05, 1.0), (2.0, 0.6), (10.0, 0.4)])
def test_an_offset_is_found_when_its_mean_over_the_window_says_so(times, within_s):
    """L⁴ of a step is 1 − e^(−wt) Σ (wt)^k/k! to k = 3; the mean of the window crosses 1/times."""
    limit_nm = TIMES_SCATTER * SCATTER_NM + SHARE * 0.9 * Rig().drive(0.0)
    at_s = 2.0
    ran = Rig(sensed=lambda t: 1.0 + (times * limit_nm if t > at_s else 0.0)).run(5.0)
    assert ran.cause is Cause.TORQUE_DISAGREES

    def response(t):
        x = W * t
        return 1.0 - math.exp(-x) * (1.0 + x + x * x / 2.0 + x**3 / 6.0)

    dt, area, history = 1e-4, 0.0, []
    t = 0.0
    while True:
        t += dt
        value = response(t) * dt
        history.append(value)
        area += value
        if len(history) > WINDOW_S / dt:
            area -= history[len(history) - 1 - round(WINDOW_S / dt)]
        if area / WINDOW_S > 1.0 / times:
            break
    assert ran.time_s - at_s == pytest.approx(t, abs=0.017)
    assert ran.time_s - at_s < within_s


def test_before_the_filters_have_settled_nothing_is_looked_at():
    ran = Rig(sensed=lambda t: 100.0).run(3.0)
    assert ran.cause is Cause.TORQUE_DISAGREES
    assert ran.time_s == pytest.approx(0.36, abs=0.01)


def test_an_offset_is_found_where_the_true_torque_is_zero_and_has_no_slope():
    limit_nm = TIMES_SCATTER * SCATTER_NM + SHARE * 0.9 * abs(Rig(torque=lambda t: 0.0).drive(0.0))
    for offset_nm, cause in ((0.99 * limit_nm, Cause.NONE), (1.01 * limit_nm, 37)):
        ran = Rig(torque=lambda t: 0.0, sensed=lambda t: offset_nm).run(3.0)  # noqa: B023
        assert ran.cause == cause
        assert ran.state.steps.model_nm2 == pytest.approx(0.0, abs=1e-6)


# --- slope


@pytest.mark.parametrize("gain", [0.7, 1.4, 0.0, -1.0])
def test_the_slope_of_a_gain_is_that_less_one(gain):
    """m is a cosine of 1 Hz, of which half a second has always the same mean square."""
    torque = lambda t: 2.0 * math.cos(2.0 * math.pi * t)  # noqa: E731
    wide = MODEL._replace(scatter_nm=100.0)
    steps = Rig(torque=torque, sensed=lambda t: gain * torque(t), model=wide).run(4.0).state.steps
    assert steps.slope_nm2 / steps.model_nm2 == pytest.approx(gain - 1.0, rel=1e-3)


@pytest.mark.parametrize("gain", [0.7, 1.4])
def test_the_slope_finds_a_gain_before_the_size_does(gain):
    """Of a cosine the root mean square is 1.11 times the mean size, π/(2 √2)."""
    torque = lambda t: 2.0 * math.cos(2.0 * math.pi * t)  # noqa: E731
    wide = MODEL._replace(scatter_nm=100.0)
    rig = Rig(torque=torque, sensed=lambda t: gain * torque(t), model=wide)
    steps = rig.run(4.0).state.steps
    slope = abs(steps.slope_nm2) / math.sqrt(steps.model_nm2)
    assert slope / steps.size_nm == pytest.approx(math.pi / math.sqrt(8.0), rel=0.01)
    own = SHARE * math.sqrt(steps.own_nm2)

    def found(limit_nm):
        rig.model = wide._replace(scatter_nm=(limit_nm - own) / TIMES_SCATTER)
        return rig.run(4.0)

    assert found(1.02 * slope).cause is Cause.NONE
    ran = found(0.98 * slope)
    assert ran.cause is Cause.TORQUE_DISAGREES
    assert ran.state.steps.size_nm < 0.95 * slope


@pytest.mark.parametrize("share", [0.0, LEAST_SHARE, 0.1])
def test_a_share_of_the_drives_own_torques_is_allowed(share):
    """0.9 of 1.21 N·m in the steady motion; never less than half a percent, four times."""
    model = MODEL._replace(scatter_share=share)
    own = TIMES_SCATTER * max(share, LEAST_SHARE) * 0.9 * Rig().drive(0.0)
    limit_nm = TIMES_SCATTER * SCATTER_NM + own
    assert Rig(model=model, sensed=lambda t: 1.0 + limit_nm - 1e-6).run(3.0).cause is Cause.NONE
    assert Rig(model=model, sensed=lambda t: 1.0 + limit_nm + 1e-6).run(3.0).cause


# --- the drive's own side


@pytest.mark.parametrize("frequency_hz", [0.5, 2.0, 5.0])
def test_the_drive_may_need_all_of_its_torque_for_itself(frequency_hz):
    """Nothing on the joint, 1 kg·m² in the drive: 12 to 400 N·m, of which 1 % would be seen."""
    heavy = MODEL._replace(inertia_kg_m2=1.0, friction_nm=0.0, zero_nm=0.0)
    rig = swinging(0.4, frequency_hz, model=heavy, torque=lambda t: 0.0)
    ran = rig.run(4.0)
    assert ran.cause is Cause.NONE
    assert ran.state.steps.size_nm < 0.008 * math.sqrt(ran.state.steps.own_nm2)
    half = heavy._replace(inertia_kg_m2=0.9)
    assert swinging(0.4, frequency_hz, model=heavy).run(4.0, limits(half)).cause


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_damping_and_friction_are_taken_off_in_their_direction(damping):
    model = MODEL._replace(damping_nm_s_rad=damping, friction_nm=2.0)
    for direction in (1.0, -1.0):
        moved = {"angle": lambda t: direction * SPEED * t, "velocity": lambda t: direction * SPEED}  # noqa: B023
        assert Rig(model=model, **moved).run(3.0).state.steps.size_nm < 1e-9


def test_a_slip_that_is_known_is_no_excuse_and_one_that_is_not_is_allowed():
    """At rest the friction may be anything up to F_c either way; beyond it, e begins."""
    still = {"angle": lambda t: 0.2, "velocity": lambda t: 0.0, "friction": lambda t: 0.0}
    scatter = TIMES_SCATTER * SCATTER_NM + SHARE * 1.0
    for sign in (1.0, -1.0):
        within = Rig(sensed=lambda t: 1.0 + sign * (0.3 + 0.9 * scatter), **still)  # noqa: B023
        beyond = Rig(sensed=lambda t: 1.0 + sign * (0.3 + 1.1 * scatter), **still)  # noqa: B023
        assert within.run(3.0).cause is Cause.NONE
        assert beyond.run(3.0).cause is Cause.TORQUE_DISAGREES
    assert Rig(sensed=lambda t: 1.3).run(3.0).cause is Cause.TORQUE_DISAGREES


def test_what_counts_as_slipping():
    def unknown(velocity_rad_s, duration_s=3.0):
        rig = Rig(velocity=lambda t: velocity_rad_s, angle=lambda t: velocity_rad_s * t)
        return rig.run(duration_s).state.steps.terms.unknown

    assert unknown(SLIPS_RAD_S) == pytest.approx(1.0)
    assert unknown(1.1 * SLIPS_RAD_S) == pytest.approx(0.0, abs=1e-6)
    assert unknown(-1.1 * SLIPS_RAD_S) == pytest.approx(0.0, abs=1e-6)


def test_after_it_turned_back_the_drive_slips_when_it_has_gone_far_enough():
    """At 0.05 rad/s for 0.12 s of the way the friction is unknown, then it is known again."""
    turn_s = 2.0
    rig = Rig(
        velocity=lambda t: 0.05 if t <= turn_s else -0.05,
        angle=lambda t: 0.05 * (turn_s - abs(t - turn_s)),
    )
    bounds = limits()
    state = rig.run(turn_s + 0.9 * PRESLIDING_RAD / 0.05).state
    assert (state.toward, state.unknown > 0.0 or state.readings == 0) == (-1.0, True)
    before = state.steps.unknown[0]
    state = rig.run(turn_s + 0.3).state
    assert before == pytest.approx(1.0)
    assert state.steps.unknown[0] == pytest.approx(0.0)
    assert state.steps.sign[0] == pytest.approx(-1.0)
    assert bounds.model.friction_nm == 0.3


# --- time


@pytest.mark.parametrize("ages_s", [(0.0, 0.0, 0.01), (0.0, 0.01, 0.0), (0.01, 0.0, 0.0)])
def test_stamps_put_the_signals_to_the_same_time(ages_s):
    """0.3 sin at 1 Hz with 0.5 kg·m²: 10 ms unseen would leave 6 % of 6 N·m."""
    model = MODEL._replace(inertia_kg_m2=0.5, friction_nm=0.0)
    rig = swinging(0.3, 1.0, model=model, ages_s=ages_s)
    aligned = rig.run(4.0).state.steps.size_nm
    assert aligned < 0.02
    unseen = swinging(0.3, 1.0, model=model, late_s=0.01).run(4.0)
    assert unseen.cause is Cause.TORQUE_DISAGREES


def test_a_delay_that_no_stamp_knows_is_the_models():
    model = MODEL._replace(inertia_kg_m2=0.5, friction_nm=0.0, late_s=0.01)
    assert swinging(0.3, 1.0, model=model, late_s=0.01).run(4.0).state.steps.size_nm < 0.02


def test_late_ticks_are_filled_in_and_a_long_gap_begins_anew():
    """A gap of 40 ms every 0.2 s in a swing with 0.05 kg·m²; one of 0.6 s is no motion at all."""
    late = swinging(0.1, 1.0, elapsed=lambda k: 40 if k % 200 == 0 else 1, friction=lambda t: 0.0)
    late.model = MODEL._replace(friction_nm=0.0)
    assert late.run(6.0).cause is Cause.NONE
    rig = Rig()
    state = rig.run(2.0).state
    gone = Rig(angle=lambda t: 50.0, elapsed=lambda k: 600 if k == 0 else 1)
    after = gone.run(0.604, state=state).state
    steps = after.steps
    assert steps.settled_s == pytest.approx(0.008)  # nothing is looked at for a while
    assert steps.angle == (50.0,) * 5
    assert (steps.sign, steps.unknown) == ((1.0,) * 5, (0.0,) * 5)
    assert (steps.window.any(), steps[8:]) == (False, (0, 0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("tick_hz", [1000.0, 100.0, 50.0])
def test_the_window_is_half_a_second_whatever_the_ticks(tick_hz):
    bounds = limits(tick_hz=tick_hz)
    assert bounds.window_steps * bounds.step_s == pytest.approx(WINDOW_S, abs=0.01)
    ran = Rig(tick_hz=tick_hz, sensed=lambda t: 1.0 + (1.0 if t > 2.0 else 0.0)).run(4.0)
    assert ran.cause is Cause.TORQUE_DISAGREES
    assert 2.0 < ran.time_s < 2.5


# --- readings that are none, and no model


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_left_out(bad):
    rig = Rig(sensed=lambda t: bad if round(1000 * t) % 3 else 1.0)
    ran = rig.run(3.0)
    assert ran.cause is Cause.NONE
    assert ran.state.steps.size_nm == pytest.approx(0.0, abs=1e-3)


def test_a_drive_without_a_torque_is_never_compared():
    ran = Rig(drive=lambda t: math.nan, sensed=lambda t: 100.0).run(3.0)
    assert ran.cause is Cause.NONE
    assert ran.state.steps.settled_s == 0.0


@pytest.mark.parametrize(("silent_s", "stops"), [(0.49, False), (0.51, True)])
def test_a_drive_that_reports_no_torque_any_more_stops_the_rig(silent_s, stops):
    """A second witness that has gone must not go unnoticed."""
    rig = Rig()
    rig.drive, sound = lambda t: math.nan if 1.0 < t <= 1.0 + silent_s else sound(t), rig.drive
    ran = rig.run(3.0)
    assert ran.cause is (Cause.TORQUE_DISAGREES if stops else Cause.NONE)
    assert ran.time_s == pytest.approx(1.0 + WINDOW_S if stops else 3.0, abs=0.009)


def test_a_torque_beyond_arithmetic_does_not_end_the_law():
    """Its square is infinite, and so what the window holds is no number from then on."""
    rig = Rig()
    rig.drive, sound = lambda t: 1e200 if abs(t - 1.0) < 0.5 * DT else sound(t), rig.drive
    ran = rig.run(3.0)
    assert ran.cause is Cause.TORQUE_DISAGREES


@pytest.mark.parametrize("name", ["friction_nm", "zero_nm", "scatter_nm"])
def test_a_model_that_is_no_number_lets_nothing_pass(name):
    assert Rig().run(3.0, limits(MODEL._replace(**{name: math.nan}))).cause != Cause.NONE


def test_without_a_model_the_law_is_off():
    off = drive_torque_limits(parse_settings({}))
    assert off.model == DriveModel()
    assert Rig(sensed=lambda t: 1e6).run(3.0, off).cause is Cause.NONE


def test_a_sensor_that_was_zeroed_is_compared_with_the_model_of_before():
    bounds, _ = zeroed(limits(), drive_torque_state(limits()), 0.4)
    assert isinstance(bounds, DriveTorqueLimits)
    ran = Rig(sensed=lambda t: 1.0 - 0.4).run(3.0, bounds)
    assert ran.cause is Cause.NONE
    assert ran.state.steps.size_nm == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seconds", [0.0, 1.0, 1.003])
def test_to_zero_the_sensor_while_its_torque_is_compared_is_no_fault(seconds):
    """What the filters hold is less by the bias at once, in the middle of a mean as well."""
    model = MODEL._replace(zero_nm=0.9)
    before = Rig(model=model, sensed=lambda t: 1.0).run(seconds, limits(model))
    bounds, state = zeroed(limits(model), before.state, 0.9)
    rig = Rig(model=model, sensed=lambda t: 1.0 - 0.9, angle=lambda t: SPEED * (seconds + t))
    after = rig.run(1.0, bounds, state)
    assert after.cause is Cause.NONE
    assert after.state.steps.size_nm == pytest.approx(0.0, abs=1e-9)


def test_it_begins_with_nothing():
    steps, *ticks = drive_torque_state(limits())
    assert ticks == [0.0] * 11
    window, *filters = steps[:6]
    assert (window.shape, window.any()) == ((62, 4), False)
    assert all(math.isnan(one[0]) and one[1:] == (0.0,) * 4 for one in filters)
    assert steps.terms == (0.0,) * 6 + (1.0,)
    assert steps[7:] == (0.0,) * 6
    assert tuple(DriveModel()) == (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.inf, 0.0)


def one_tick(state, torque, elapsed):
    return drive_torque_step(limits(), state, torque, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, elapsed)[0]


def test_a_tick_counts_as_one_at_least():
    assert one_tick(drive_torque_state(limits()), 0.0, 0).ticks == 1


def test_a_gap_is_no_part_of_a_mean_with_what_was_before():
    state = drive_torque_state(limits())
    for _ in range(12):
        state = one_tick(state, 0.0, 1)
    assert (state.ticks, state.readings) == (4, 4)
    state = one_tick(state, 1.0, 40)
    assert (state.ticks, state.readings) == (0, 0)
    assert state.steps.torque[0] == 1.0
    assert state.steps.settled_s == pytest.approx(0.052)


def test_the_numbers_are_those_of_the_documents():
    assert (WINDOW_S, SETTLED_S, SLIPS_RAD_S, PRESLIDING_RAD) == (0.5, 0.35, 0.02, 0.006)
    assert (TIMES_SCATTER, LEAST_SHARE) == (4.0, 0.005)


def test_more_readings_within_a_step_do_not_count_twice():
    first = Rig().run(3.0).state
    assert own_nm(Ran(0.0, Cause.NONE, first)) == pytest.approx(SHARE * 0.9 * Rig().drive(0.0))
