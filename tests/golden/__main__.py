"""Write the table of answers anew: `make golden`. Look at the difference before you commit it."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from tests.golden.cases import CASES
from tests.golden.page import PAGE, page_of
from tests.golden.table import differences, read, text_of

TABLE = Path(__file__).with_name("answers.txt")


def main() -> None:
    """Compute the cases that are named, or all, print what differs, and write the table."""
    answers = read(TABLE) if TABLE.exists() else {}
    kept = {name: answers.pop(name) for name in set(answers) - set(CASES)}
    print("\n".join(f"gone: {name}" for name in kept))
    for name in sys.argv[1:] or CASES:
        case = CASES[name]
        if case.needs and not case.needs.exists():
            print(f"{name}: left as it was, {case.needs} is absent")
            continue
        began_s = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            found = case.answers(Path(folder))
        took_s = time.process_time() - began_s
        print(f"{name}: {len(found)} rows, {took_s:.2f} s")
        print("\n".join(differences(answers.get(name, {}), found)[:40]))
        answers[name] = found
    TABLE.write_text(text_of(answers), encoding="utf-8")
    PAGE.write_text(page_of(CASES, read(TABLE)), encoding="utf-8")


if __name__ == "__main__":
    main()
