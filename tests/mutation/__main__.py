"""Put faults into what moves the arm and see that a test fails.

    python -m tests.mutation [--hand-made] [--every N] [part of a mutant's name]

Every small fault of the modules in `runner.TESTS`, or those of `hand_made`. Ends with 1 if a mutant
survives that is not known to do the same as the source, if a known one is no longer there, or if a
module fails its tests without any fault. With `--every` only the tests that saw a fault are run
without one.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from tests.mutation.equivalent import EQUIVALENT
from tests.mutation.hand_made import HAND_MADE
from tests.mutation.mutants import PACKAGE, mutants, unchanged
from tests.mutation.runner import TESTS, seen_by, tests_of


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

    def needed(name: str) -> bool:
        return name in known or (asked.name in name and not asked.hand_made)

    small = [mutant for path in modules for mutant in mutants(path, needed)]
    wrong = [f"no longer there: {n}" for n in known - {m.name for m in small}]
    everything = [fault.mutant() for fault in HAND_MADE] if asked.hand_made else small
    wanted = [m for m in everything if asked.name in m.name and m.name not in known]
    wanted = wanted[:: asked.every]
    saw: dict[Path, list[str]] = {}
    left = 0
    if asked.every == 1:  # of the modules with the same tests one is enough: nothing is changed
        of_tests = {frozenset(tests_of(mutant.path)): mutant.path for mutant in wanted}
        wrong += _failing_as_it_is({path: list(tests_of(path)) for path in of_tests.values()})
    print(*wrong, sep="\n", end="\n" if wrong else "", flush=True)
    for mutant, test in seen_by(wanted):
        left += not test
        saw.setdefault(mutant.path, []).append(test)
        if asked.seen or not test:
            print(f"seen by {test}:" if test else "survived:", mutant.name, flush=True)
    if asked.every > 1:
        found = _failing_as_it_is({path: _to_run(path, names) for path, names in saw.items()})
        print(*found, sep="\n", end="\n" if found else "", flush=True)
        wrong += found
    print(
        f"{len(wanted)} mutants, {left} survived, {len(EQUIVALENT)} known to do the same, "
        f"{time.monotonic() - start:.0f} s"
    )
    return int(left > 0 or len(wrong) > 0)


def _failing_as_it_is(tests: dict[Path, list[str]]) -> list[str]:
    sound = seen_by([unchanged(path) for path in tests], tests=tests)
    return [f"fails its tests as it is: {mutant.name}: {test}" for mutant, test in sound if test]


def _to_run(path: Path, names: list[str]) -> list[str]:
    """Return the tests by name; all of the module's if a fault was seen without one."""
    alone = all("::" in name for name in names)
    return list(dict.fromkeys(names)) if alone else list(tests_of(path))


if __name__ == "__main__":
    sys.exit(main())
