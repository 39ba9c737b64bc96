"""Whether the command line still computes the numbers that it computed before.

The numbers of fixed inputs are kept in `tests/reference/numbers`, at full precision. They tell that
a change of the code has changed no result; they do not tell that a result is right.

    python -m benchmarks.same_numbers                       # against those that are kept
    python -m benchmarks.same_numbers --group study         # one group
    python -m benchmarks.same_numbers --full                # the slow groups too
    python -m benchmarks.same_numbers --write FILE --full   # keep those of this code

Numbers that differ for a reason in `benchmarks.numbers.explained` are listed with that reason. The
status is 1 if any other number differs.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.numbers.difference import Compared, compare
from benchmarks.numbers.documents import Numbers
from benchmarks.numbers.explained import EXPLANATIONS, explanation
from benchmarks.numbers.groups import GROUPS, Absent
from benchmarks.numbers.inputs import ROOT, Workspace

KEPT = ROOT / "tests" / "reference" / "numbers" / "numbers.json"
SCHEMA = "rigidimeter.numbers/1"
TOLERANCE = 1e-9
"""Relative. The same operations in another order differ by far less."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Compute the numbers, and write or compare them."""
    options = _parser().parse_args(arguments)
    names = options.group or [name for name, one in GROUPS.items() if options.full or not one.slow]
    kept = {} if options.write else _read(options.against)["groups"]
    with tempfile.TemporaryDirectory() as temporary:
        work = Workspace((options.keep or Path(temporary)).resolve())
        found: dict[str, Numbers] = {}
        same = True
        for name in names:
            start_s = time.perf_counter()
            try:
                found[name] = GROUPS[name].numbers(work)
            except Absent as absent:
                print(f"{name}: skipped, {absent}")
                continue
            passed_s = time.perf_counter() - start_s
            if options.write:
                print(f"{name}: {_count(found[name])} values, {passed_s:.0f} s")
            elif name not in kept:
                print(f"{name}: nothing is kept to compare with")
                same = False
            else:
                same &= _say(name, compare(kept[name], found[name], TOLERANCE), passed_s)
    if options.write:
        _write(options.write, found)
    return 0 if same else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.same_numbers", description=(__doc__ or "").partition("\n")[0]
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--against", type=Path, metavar="FILE", default=KEPT, help="numbers to compare with"
    )
    which.add_argument(
        "--write", type=Path, metavar="FILE", help="keep the numbers; other groups in FILE stay"
    )
    parser.add_argument("--group", action="append", choices=GROUPS, help="this group; repeatable")
    parser.add_argument("--full", action="store_true", help="the slow groups too")
    parser.add_argument(
        "--keep", type=Path, metavar="DIR", help="new folder for all that the commands write"
    )
    return parser


def _say(name: str, found: Compared, passed_s: float) -> bool:
    """Print how a group compares, and return whether all that differs is explained."""
    worst = "all equal to the bit" if found.worst is None else f"worst {found.worst}"
    print(f"{name}: {found.values} values, {passed_s:.0f} s, {worst}")
    reasons = [(one, explanation(name, one)) for one in found.differing]
    for reason in EXPLANATIONS:
        explained = [one for one, of in reasons if of is reason]
        if explained:
            furthest = max(explained, key=lambda one: one.relative)
            print(f"  explained  {len(explained)} of {reason.name}: {reason.reason}")
            print(f"             worst {furthest}")
    unexplained = [one for one, of in reasons if of is None]
    for one in unexplained:
        print(f"  differs  {one}")
    for missing in found.missing:
        print(f"  missing  {missing}")
    for new in found.new:
        print(f"  new      {new}")
    return not unexplained and not found.missing


def _count(numbers: Numbers) -> int:
    return sum(len(value) if isinstance(value, list) else 1 for value in numbers.values())


def _read(path: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    if document["schema"] != SCHEMA:
        raise SystemExit(f"{path}: is {document['schema']}, not {SCHEMA}")
    return document


def _write(path: Path, found: dict[str, Numbers]) -> None:
    """Write the numbers, one name a line; groups that were not computed stay as they are."""
    groups = _read(path)["groups"] if path.exists() else {}
    groups |= found
    lines = [
        f"{json.dumps(name)}: {{\n"
        + ",\n".join(f"{json.dumps(key)}: {_compact(value)}" for key, value in numbers.items())
        + "\n}"
        for name, numbers in groups.items()
    ]
    text = f'{{\n"schema": "{SCHEMA}",\n"groups": {{\n' + ",\n".join(lines) + "\n}\n}\n"
    path.write_text(text, encoding="utf-8")


def _compact(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


if __name__ == "__main__":
    sys.exit(main())
