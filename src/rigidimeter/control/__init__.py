"""Pure discrete steps: (coefficients, state, input) -> (state, output); no clock, no I/O.

Steps are plain functions of numbers that only add, multiply and compare; everything that needs a
transcendental function is computed once, when the coefficients are made. So the same source runs
in the interpreter and compiled, with the same bits.
"""

from rigidimeter.control.admittance import Admittance, admittance, admittance_step
from rigidimeter.control.filters import Biquad, BiquadState, biquad_step, butterworth_lowpass
from rigidimeter.control.tracking import minimum_jerk, tracking_step
