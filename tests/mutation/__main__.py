"""Put every small fault into the guard, and into how a driver stops, and see that a test fails.

    python -m tests.mutation [--every N] [part of a mutant's name]

Ends with 1 if a mutant survives that is not known to do the same as the module, if a known one is
no longer there, or if a module fails its tests without any fault.
"""

from __future__ import annotations

import argparse
import sys
import time

from tests.mutation.equivalent import EQUIVALENT
from tests.mutation.mutants import modules, mutants, title, unchanged
from tests.mutation.runner import survivors


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutation")
    parser.add_argument("--every", type=int, default=1, help="only one in so many")
    parser.add_argument("name", nargs="?", default="", help="only those whose name holds this")
    asked = parser.parse_args()

    start = time.monotonic()
    paths = modules()
    everything = [mutant for path in paths for mutant in mutants(path)]
    wrong = [f"no longer there: {n}" for n in set(EQUIVALENT) - {m.name for m in everything}]
    sound = {mutant.name for mutant in survivors([unchanged(path) for path in paths])}
    wrong += [f"fails its tests as it is: {title(p)}" for p in paths if title(p) not in sound]
    wanted = [m for m in everything if asked.name in m.name and m.name not in EQUIVALENT]
    wanted = wanted[:: asked.every]
    print(*wrong, sep="\n", end="\n" if wrong else "", flush=True)
    left = 0
    for mutant in survivors(wanted):
        left += 1
        print(f"survived: {mutant.name}", flush=True)
    print(
        f"{len(wanted)} mutants, {left} survived, {len(EQUIVALENT)} known to do the same, "
        f"{time.monotonic() - start:.0f} s"
    )
    return int(left > 0 or len(wrong) > 0)


if __name__ == "__main__":
    sys.exit(main())
