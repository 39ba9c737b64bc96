"""The only place with time: the clock, the loop, and the run of a session."""

from rigidimeter.acquisition.clock import Clock, RealTimeClock, SimulatedClock
from rigidimeter.acquisition.control_modes import ControlLoop
from rigidimeter.acquisition.session_run import SessionResult, run_session

__all__ = [
    "Clock",
    "ControlLoop",
    "RealTimeClock",
    "SessionResult",
    "SimulatedClock",
    "run_session",
]
