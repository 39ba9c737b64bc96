"""Many virtual epochs at once, compiled from the steps that the loop itself takes."""

from rigidimeter.batch.bench import Bench, bench
from rigidimeter.batch.inputs import EpochInputs, draw_inputs
from rigidimeter.batch.result import Batch
from rigidimeter.batch.run import simulate_inputs
from rigidimeter.batch.simulate import epoch_generator, simulate_chunks, simulate_epochs

__all__ = [
    "Batch",
    "Bench",
    "EpochInputs",
    "bench",
    "draw_inputs",
    "epoch_generator",
    "simulate_chunks",
    "simulate_epochs",
    "simulate_inputs",
]
