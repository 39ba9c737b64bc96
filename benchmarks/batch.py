"""The compiled batch against linear filters, a physics engine, the loop, and itself at other sizes.

The reference of the filters is the same loop without what is not linear: no limits, no rounding, no
noise. Its state is (θ, θ', θ'', two delays of the low-pass, the velocity command, the torque that
the sensor took at the tick before), order 7; the matrices are read off the steps themselves.

    python -m benchmarks.batch
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from benchmarks.paired import REPEATS, Row, in_ms, paired
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import (
    BiquadState,
    DriveState,
    JointDynamics,
    admittance_step,
    arm_torque_nm,
    biquad_step,
    drive_step,
)
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.acquisition import ControlLoop, SimulatedClock, perturb
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.virtual.batch import (
    Bench,
    bench,
    draw_inputs,
    empty_rows,
    epoch_generator,
    run_row,
    simulate_chunks,
)

Matrices = tuple[NDArray[np.float64], ...]

SETTINGS = Settings()
JOINT = JointDynamics(0.0045, 0.1368, 1.751)
STEADY_REPEATS = 21
ORDER = 7
EPOCHS = 8

HINGE = """
<mujoco>
  <option timestep="{interval_s}" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody>
    <body>
      <inertial pos="0 0 0" mass="1" diaginertia="{J} {J} {J}"/>
      <joint name="hinge" type="hinge" axis="0 0 1" damping="{B}" stiffness="{K}"/>
    </body>
  </worldbody>
  <actuator><velocity joint="hinge" kv="10"/></actuator>
</mujoco>
"""


def one_tick(
    table: Bench, x: NDArray[np.float64], perturbation_nm: float
) -> tuple[NDArray[np.float64], float]:
    """Return the next state and the torque the loop reads at this tick."""
    coefficients = table.coefficients
    state, filtered = DriveState(*x[:3]), BiquadState(*x[3:5])
    command, torque_nm = x[5], x[6]
    filtered, smooth_nm = biquad_step(coefficients.lowpass, filtered, torque_nm)
    command = admittance_step(coefficients.admittance, command, perturbation_nm, smooth_nm)
    taken_nm = arm_torque_nm(
        JOINT.inertia_kg_m2, JOINT.damping_nm_s_rad, JOINT.stiffness_nm_rad, *state, 0.0
    )
    moved = drive_step(coefficients.drive, state, command)
    return np.array([*moved, *filtered, command, taken_nm]), torque_nm


def linear_loop(table: Bench) -> Matrices:
    """Return A, B, C, D of perturbation → torque, from the steps on unit vectors."""
    columns = [one_tick(table, row, 0.0) for row in np.eye(ORDER)]
    pushed, through = one_tick(table, np.zeros(ORDER), 1.0)
    return (
        np.column_stack([column for column, _ in columns]),
        pushed[:, None],
        np.array([[output for _, output in columns]]),
        np.array([[through]]),
    )


def ideal_settings() -> Settings:
    """No noise, no rounding: what the linear loop leaves out and can be set to nothing."""
    return parse_settings(
        {
            "rig": {
                "torque": {"noise_sd_nm": 0.0, "resolution_nm": 0.0},
                "motion": {"angle_resolution_deg": 0.0, "velocity_resolution_deg_s": 0.0},
            }
        }
    )


class Steady:
    """20 s epochs at 1 kHz, one after the other, their random numbers drawn beforehand."""

    def __init__(self, settings: Settings, n_epochs: int = 1) -> None:
        self.wanted_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
        self.wanted_nm.setflags(write=False)
        self.bench = bench(settings, self.wanted_nm.size)
        rng = epoch_generator(settings.seed, 0)
        self.inputs = draw_inputs(self.bench, settings.subject["OFF"], rng, JOINT)
        self.rows = empty_rows(n_epochs, self.bench)

    def __call__(self) -> NDArray[np.float64]:
        for row in range(len(self.rows["ticks"])):
            run_row(self.rows, row, self.bench, self.wanted_nm, self.inputs)
        return self.rows["torque_nm"][0]


def against_lfilter(steady: Steady, repeats: int) -> Row:
    b, a = signal.ss2tf(*linear_loop(steady.bench))
    ideal = Steady(ideal_settings())
    difference = np.abs(ideal() - signal.lfilter(b[0], a, ideal.wanted_nm)).max()
    assert difference < 1e-6, f"the linear loop differs by {difference:.2g} N·m"
    name = f"batch epoch of 20 s at 1 kHz, steady / scipy.signal.lfilter of order {ORDER}"
    return in_ms(name, paired(steady, lambda: signal.lfilter(b[0], a, steady.wanted_nm), repeats))


def against_control(steady: Steady, repeats: int) -> list[Row]:
    try:
        import control
    except ImportError:
        print("control is not installed: no row for control.forced_response", file=sys.stderr)
        return []
    system = control.ss(*linear_loop(steady.bench), 1e-3)
    name = "batch epoch of 20 s at 1 kHz, steady / control.forced_response"
    times_s = paired(
        steady, lambda: control.forced_response(system, inputs=steady.wanted_nm), repeats
    )
    return [in_ms(name, times_s)]


def against_mujoco(repeats: int) -> list[Row]:
    try:
        import mujoco
        from mujoco import rollout
    except ImportError:
        print("mujoco is not installed: no row for mujoco.rollout", file=sys.stderr)
        return []
    model = mujoco.MjModel.from_xml_string(
        HINGE.format(
            interval_s=1e-3,
            J=JOINT.inertia_kg_m2,
            B=JOINT.damping_nm_s_rad,
            K=JOINT.stiffness_nm_rad,
        )
    )
    data = mujoco.MjData(model)
    # A batch on both sides, as both are made for: after the engine has run, the first of ours finds
    # the caches empty, and one epoch alone would measure that.
    many = Steady(SETTINGS, EPOCHS)
    many()
    states = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    starts = np.zeros((EPOCHS, states))
    commands = many.rows["velocity_command_rad_s"][..., None].copy()
    name = (
        f"batch, {EPOCHS} epochs of 20 s at 1 kHz, steady / mujoco.rollout of as many of a hinge "
        "with a velocity servo"
    )
    work = paired(many, lambda: rollout.rollout(model, data, starts, commands), repeats)
    return [in_ms(name, work)]


def against_loop(repeats: int) -> Row:
    """From seed to columns, random numbers and all, against the loop in the interpreter."""
    wanted = prbs_nm(SETTINGS.prbs, SETTINGS.rig.tick_rate_hz).tolist()

    def interpreted() -> None:
        rig = SimulatedRig(SETTINGS.rig, SETTINGS.subject["OFF"], epoch_generator(1, 0))
        rig.enable()
        perturb(ControlLoop(SETTINGS, rig, SimulatedClock(), [].append), 1, wanted)

    name = "batch epoch of 20 s at 1 kHz with its random numbers / the loop in the interpreter"
    return in_ms(name, paired(lambda: list(simulate_chunks(SETTINGS, 1)), interpreted, repeats))


def measured_run(n_epochs: int) -> dict[str, float]:
    """Time a run of default epochs in this process; give its time and its peak memory."""
    for _ in simulate_chunks(SETTINGS, 1):
        pass  # compile, or load what was compiled
    start = time.perf_counter()
    for batch in simulate_chunks(SETTINGS, n_epochs):
        assert not batch.cause.any()
    elapsed_s = time.perf_counter() - start
    return {"s": elapsed_s, "mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}


def apart(n_epochs: int) -> dict[str, float]:
    """Measure a run in a process of its own, so that its peak memory is its own."""
    command = [sys.executable, "-m", "benchmarks.batch", str(n_epochs)]
    ran = subprocess.run(command, check=True, capture_output=True, text=True)
    return dict(json.loads(ran.stdout))


def growth(few: int, many: int) -> list[Row]:
    """Cost per epoch and peak memory of many epochs, against those of few."""
    small, large = apart(few), apart(many)
    return [
        in_ms(
            f"batch, time per epoch of {many} epochs / of {few}",
            (large["s"] / many, small["s"] / few),
        ),
        Row(f"batch, peak memory of {many} epochs / of {few}", large["mb"], small["mb"], "MB"),
    ]


def rows(
    steady_repeats: int = STEADY_REPEATS,
    repeats: int = REPEATS,
    grows: tuple[int, int] = (100, 10_000),
) -> list[Row]:
    """Return what was measured; of epochs as few as many of `grows` are run."""
    steady = Steady(SETTINGS)
    return [
        against_lfilter(steady, steady_repeats),
        *against_control(steady, repeats),
        *against_mujoco(steady_repeats),
        against_loop(repeats),
        *growth(*grows),
    ]


def main() -> None:
    if len(sys.argv) > 1:
        print(json.dumps(measured_run(int(sys.argv[1]))))
        return
    for row in rows():
        print(row)


if __name__ == "__main__":
    main()
