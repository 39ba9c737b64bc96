"""The only place with time: the clock, the control loop, and the run of a session."""

from rigidimeter.acquisition.clock import Clock, DeadlineClock, SimulatedClock
from rigidimeter.acquisition.control_modes import follow, hold, perturb, rest
from rigidimeter.acquisition.session_run import SessionResult, run_session
from rigidimeter.acquisition.tick import ControlLoop, ramp_to_rest

__all__ = [
    "Clock",
    "ControlLoop",
    "DeadlineClock",
    "SessionResult",
    "SimulatedClock",
    "follow",
    "hold",
    "perturb",
    "ramp_to_rest",
    "rest",
    "run_session",
]
