"""The only place with time: the clock, the control loop, and the run of a session.

`session_run` is not imported here: the recorder's and the console's processes do without it, and
start sooner.
"""

from rigidimeter.acquisition.clock import Clock, DeadlineClock, SimulatedClock
from rigidimeter.acquisition.control_modes import follow, hold, perturb, rest
from rigidimeter.acquisition.ramp import ramp_to_rest
from rigidimeter.acquisition.tick import ControlLoop
