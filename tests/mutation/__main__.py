"""Put faults into what moves the arm and see that a test fails.

    python -m tests.mutation [--hand-made] [--every N] [part of a mutant's name]

Every small fault of the modules in `runner.TESTS`, or those of `hand_made`. Ends with 1 if a mutant
survives that is not known to do the same as the source, if a known one is no longer there, or if a
module fails its tests without any fault.
"""

from __future__ import annotations

import argparse
import sys
import time

from tests.mutation.equivalent import EQUIVALENT
from tests.mutation.hand_made import HAND_MADE
from tests.mutation.mutants import PACKAGE, mutants, unchanged
from tests.mutation.runner import TESTS, seen_by


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutation")
    parser.add_argument("--hand-made", action="store_true", help="those made by hand")
    parser.add_argument("--every", type=int, default=1, help="only one in so many")
    parser.add_argument("--seen", action="store_true", help="print which test saw each")
    parser.add_argument("name", nargs="?", default="", help="only those whose name holds this")
    asked = parser.parse_args()

    start = time.monotonic()
    modules = [PACKAGE / name for name in TESTS]
    known = EQUIVALENT.keys()
    small = [m for path in modules for m in mutants(path, lambda n: asked.name in n or n in known)]
    wrong = [f"no longer there: {n}" for n in known - {m.name for m in small}]
    everything = [fault.mutant() for fault in HAND_MADE] if asked.hand_made else small
    wanted = [m for m in everything if asked.name in m.name and m.name not in known]
    wanted = wanted[:: asked.every]
    # Of the modules with the same tests one is enough: nothing is changed.
    needed = [path for path in modules if path in {m.path for m in wanted}]
    of_tests = {frozenset(TESTS[path.relative_to(PACKAGE).as_posix()]): path for path in needed}
    sound = seen_by([unchanged(path) for path in of_tests.values()])
    wrong += [f"fails its tests as it is: {mutant.name}: {test}" for mutant, test in sound if test]
    print(*wrong, sep="\n", end="\n" if wrong else "", flush=True)
    left = 0
    for mutant, test in seen_by(wanted):
        left += not test
        if asked.seen or not test:
            print(f"seen by {test}:" if test else "survived:", mutant.name, flush=True)
    print(
        f"{len(wanted)} mutants, {left} survived, {len(EQUIVALENT)} known to do the same, "
        f"{time.monotonic() - start:.0f} s"
    )
    return int(left > 0 or len(wrong) > 0)


if __name__ == "__main__":
    sys.exit(main())
