"""Write the table of answers anew: `make golden`. Look at the difference before you commit it.

    python -m tests.golden [CASE …]             these cases or all
    python -m tests.golden --compare [CASE …]   print old and new in two columns, write nothing

`--compare` prints the case that differs most first: `!` is beyond the tolerance, `=` beyond it as
expected (`rebuilt.toml`).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.golden.cases import CASES
from tests.golden.page import PAGE, page_of
from tests.golden.rebuilt import columns, size
from tests.golden.table import Row, differences, read, text_of

TABLE = Path(__file__).with_name("answers.txt")


def computed(names: Sequence[str]) -> Iterator[tuple[str, dict[str, Row]]]:
    """Yield the answers of each case whose input is there."""
    for name in names or CASES:
        case = CASES[name]
        if case.needs and not case.needs.exists():
            print(f"{name}: left as it was, {case.needs} is absent", file=sys.stderr)
            continue
        began_s = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            found = case.answers(Path(folder))
        took_s = time.process_time() - began_s
        print(f"{name}: {len(found)} rows, {took_s:.2f} s", file=sys.stderr, flush=True)
        yield name, found


def compare(names: Sequence[str]) -> None:
    """Print what differs from the table."""
    kept, found = read(TABLE), dict(computed(names))
    far = {name: size(differences(kept.get(name, {}), now)) for name, now in found.items()}
    for name in sorted(found, key=lambda name: -far[name]):
        lines = list(columns(CASES[name], kept.get(name, {}), found[name]))
        print(f"[{name}]" if lines else f"[{name}] the same", *lines, sep="\n")


def write(names: Sequence[str]) -> None:
    """Print what differs, and write the table and the page."""
    answers = read(TABLE) if TABLE.exists() else {}
    kept = {name: answers.pop(name) for name in set(answers) - set(CASES)}
    print("\n".join(f"gone: {name}" for name in kept))
    for name, found in computed(names):
        print(*differences(answers.get(name, {}), found)[:40], sep="\n")
        answers[name] = found
    TABLE.write_text(text_of(answers), encoding="utf-8")
    PAGE.write_text(page_of(CASES, read(TABLE)), encoding="utf-8")


def main() -> None:
    """Compute the cases that are named, or all; compare or write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("cases", nargs="*", metavar="CASE")
    parser.add_argument("--compare", action="store_true", help="print both, write nothing")
    options = parser.parse_args()
    if unknown := set(options.cases) - set(CASES):
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    (compare if options.compare else write)(options.cases)


if __name__ == "__main__":
    main()
