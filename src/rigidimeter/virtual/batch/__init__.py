"""Many virtual epochs at once, compiled from the steps that the loop itself takes."""

from rigidimeter.virtual.batch.batch_rig import Bench, bench, draw_inputs
from rigidimeter.virtual.batch.batch_run import Batch, empty_rows, run_row, simulate_inputs
from rigidimeter.virtual.batch.batch_simulate import (
    epoch_generator,
    simulate_chunks,
    simulate_epochs,
)
from rigidimeter.virtual.batch.compiled_steps import enum_numbers, with_helpers
