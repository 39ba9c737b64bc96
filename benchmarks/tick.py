"""What the guard's laws of agreement cost a tick: CPU time with and without them, in turn.

The loop runs the simulated rig for 20 s of PRBS perturbation and 20 s of rest at 1 kHz, as fast as
it goes, and records nothing. Without the laws, a step that finds nothing stands in their place. The
least of some runs is taken: whatever else the machine does only adds.

    python -m benchmarks.tick
"""

from __future__ import annotations

import argparse
import time
from typing import Any
from unittest.mock import patch

import numpy as np

from rigidimeter.acquisition import SimulatedClock, perturb, rest, tick
from rigidimeter.devices import SimulatedRig
from rigidimeter.experiment import prbs_nm
from rigidimeter.settings import parse_settings


def _agrees(_: Any, state: Any, *__: Any) -> tuple[Any, int]:
    return state, 0


def tick_us() -> float:
    """Return the CPU time of a tick, in µs."""
    settings = parse_settings({})
    rig = SimulatedRig(
        settings.rig, next(iter(settings.subject.values())), np.random.default_rng(1)
    )
    loop = tick.ControlLoop(settings, rig, SimulatedClock(), lambda _: None)
    perturbation_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz).tolist()
    began_s = time.process_time()
    perturb(loop, 0, perturbation_nm)
    rest(loop, 20.0, 2.0)
    return 1e6 * (time.process_time() - began_s) / loop.tick


def main() -> None:
    """Print the two costs and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeats", type=int, default=7)
    repeats = parser.parse_args().repeats
    found: tuple[list[float], list[float]] = ([], [])
    for _ in range(repeats):
        found[0].append(tick_us())
        with patch.object(tick, "consistency_step", _agrees):
            found[1].append(tick_us())
    ours, without = min(found[0]), min(found[1])
    print(f"{ours:.1f} µs a tick, {without:.1f} µs without the laws: {ours / without:.2f}")


if __name__ == "__main__":
    main()
