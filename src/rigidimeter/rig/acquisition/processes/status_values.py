"""What the processes tell each other: who and how they are, and what loop and estimator show."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from rigidimeter.rig.guard import Cause


class Role(IntEnum):
    """The processes."""

    LOOP = 0
    RECORDER = 1
    CONSOLE = 2
    ESTIMATOR = 3
    EMG = 4


class ProcessCondition(IntEnum):
    """How a process is.

    TROUBLE: it goes on trying, and its note says at what. FAILED: it has given up.
    """

    ABSENT = 0
    STARTING = 1
    READY = 2
    RUNNING = 3
    STOPPING = 4
    TROUBLE = 5
    DONE = 6
    FAILED = 7


class Flag(IntEnum):
    """What is raised for the loop to see; each is one number, and any process may raise it.

    END_ASKED: stop as for a fault. ABORT_ASKED: end as the operator's order `abort` does.
    """

    EMERGENCY_STOP = 0
    END_ASKED = 1
    ABORT_ASKED = 2


PAUSE_NEXT, STOP_NEXT = 1, 2
"""What `LoopStatus.pending` adds up: a pause, and the end, after this epoch."""


class LoopStatus(NamedTuple):
    """What the loop shows of itself. `state` is a `State`, `cause` a `rig.guard.Cause`.

    `pending` says what comes after this epoch. `phase` is a `Phase`. `still` says whether the joint
    stands still and goes on only by an order (1): the guard's own numbers say so, not the state
    alone. `until_s` is when the epoch, the rest or whatever else runs ends as planned, `energy_j`
    what the guard counts as going to and fro.
    """

    state: int = 0
    tick: int = -1
    epoch: int = -1
    cause: int = int(Cause.NONE)
    late_ticks: int = 0
    missed_ticks: int = 0
    pending: int = 0
    time_s: float = 0.0
    angle_rad: float = math.nan
    velocity_rad_s: float = math.nan
    torque_nm: float = math.nan
    perturbation_nm: float = math.nan
    velocity_command_rad_s: float = math.nan
    until_s: float = math.nan
    energy_j: float = math.nan
    phase: int = 0
    still: int = 0


class LiveEstimate(NamedTuple):
    """What the live estimator knows: J, B, K with standard errors, and of what time.

    Every epoch is estimated anew, so that no condition is mixed with another: `epoch` is the last
    one of which samples were taken, `since_s` and `time_s` when the first and the last of them was.
    `missed_samples` is how many it could not read in time, in all. `step_nm` is the root of the
    mean squared change of the torque from one tick to the next in that epoch.
    """

    tick: int = -1
    resting: int = 0
    missed_samples: int = 0
    epoch: int = -1
    since_s: float = 0.0
    time_s: float = 0.0
    inertia_kg_m2: float = math.nan
    inertia_kg_m2_se: float = math.inf
    damping_nm_s_rad: float = math.nan
    damping_nm_s_rad_se: float = math.inf
    stiffness_nm_rad: float = math.nan
    stiffness_nm_rad_se: float = math.inf
    memory_s: float = 0.0
    step_nm: float = math.nan
