"""What is said of made-up studies, in full, beside the tests: a text that a person can read.

`WRITE_ANSWERS=1 pytest tests/unit/analysis/study` writes it anew; read what changed.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from rigidimeter.analysis.study import (
    Compared,
    Study,
    StudyResult,
    counting,
    difference_cells,
    lead,
    statement,
    traffic_light,
)

ANSWERS = Path(__file__).with_name("answers.txt")


def said(study: Study, each: Sequence[Compared]) -> list[str]:
    """Return every verdict, sentence and notice of a study as lines."""
    lines = []
    for one in each:
        of_pair = f" {one.other} − {one.reference}" if one.other != study.other else ""
        why = f" ({one.reason})" if one.reason else ""
        n = " and ".join(str((counting(study.rows, one.measure.name)["condition"] == c).sum())
                         for c in one.pair)  # fmt: skip
        p = f"p {one.p:.3g}, adjusted {one.p_adjusted:.3g}, {one.role}" if one.tested else "no test"
        needed = f", needs {one.needed.number} {one.needed.unit}" if one.needed else ""
        sizes = ", ".join(f"{size:.4g}" for size in (*one.of_test, one.measured_half))
        lines.append(f"{one.measure.short}{of_pair}: {one.verdict}{why}; {n}; {sizes}; {p}{needed}")
    result = StudyResult(study, tuple(each), ())
    for other in dict.fromkeys(one.other for one in each):
        lines += [f"shown: {' | '.join(cells)}" for cells in difference_cells(result, other)[1]]
    lines.append(f"lead: {lead(study, each)}")
    found = statement(study, each)
    if found is not None:
        lines += [f"measured: {found.measured}", f"tested: {found.tested}"]
        lines += [f"concluded: {sentence}" for sentence in found.concluded]
    quality = traffic_light(study, each)
    if quality is not None:
        lines.append("quality: " + ", ".join(f"{k} {v}" for k, v in quality.items() if v != ""))
    lines += [f"{one.level}: {one.text}" for one in study.notices]
    lines += [f"excluded: {' '.join(map(str, one))}" for one in study.exclusions]
    lines += [f"left out: {' '.join(map(str, one))}" for one in study.left_out]
    lines += [f"not as planned: {' '.join(map(str, one))}" for one in study.deviations]
    return lines


def hold(name: str, lines: Iterable[str], place: str = "") -> None:
    """Assert that the lines are those that the text has under a name."""
    own = [line.replace(f"{place}/", "").replace(place, "STUDY") if place else line
           for line in lines]  # fmt: skip
    kept: dict[str, list[str]] = {}
    for line in ANSWERS.read_text("utf-8").splitlines() if ANSWERS.exists() else ():
        if line.startswith("# "):
            kept[line[2:]] = []
        elif line:
            kept[[*kept][-1]].append(line)
    if "WRITE_ANSWERS" in os.environ:
        kept[name] = own
        texts = ["\n".join([f"# {title}", *kept[title]]) for title in sorted(kept)]
        ANSWERS.write_text("\n\n".join(texts) + "\n", "utf-8")
    assert own == kept.get(name)
