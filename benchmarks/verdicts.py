"""How often the verdict on a study is right, wrong or withheld, with a difference and without.

Each study is recorded by the independent simulator (`tests.scenarios`) as a laboratory would have
it, a file for each session, and goes the whole way: `rigidimeter.compare` of the folder, and its
conclusion. Four days have both conditions, two epochs each of 12 s. A day moves the joint of both
conditions (SD of the logarithm: J 2 %, B 9 %, K 12 %, as in `rigidimeter.virtual.study_design`)
and each by itself (B and K, 2 %); epochs scatter by 2 %. With a difference B and K are 15 % lower
in DBS.

Half of the studies are regular: the perturbation recorded or not, the subject at rest. The others
are trapped, in turn, by what `TRAPS` lists, in DBS alone.

A verdict is right if it is the truth, wrong if it claims a difference that is not there or of the
other sign, missed if no difference is shown where there is one, withheld if it is not supported or
cannot be decided. "Before" is the rule without objections: p by days, adjusted by Holm's method,
below 0.05, and otherwise no difference.

    python -m benchmarks.verdicts run verdicts.jsonl --seconds 150   # again, until all are done
    python -m benchmarks.verdicts table verdicts.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from tests.traps.recorded_studies import ALL, AT_REST, MOTION, Session, write_study

import rigidimeter as rm
from rigidimeter.analysis.study import conclude
from rigidimeter.analysis.study.tested import LEVEL

DAYS = 4
LOWER = 0.85
DAY_SD = np.array([0.02, 0.09, 0.12])
OWN_SD = np.array([0.0, 0.02, 0.02])
OUTCOMES = ("right", "wrong", "missed", "withheld")
MEASURES = {"inertia_kg_m2": "J", "damping_nm_s_rad": "B", "stiffness_nm_rad": "K"}


@dataclass(frozen=True)
class Case:
    """What all recordings have, and what makes DBS another one."""

    name: str
    columns: tuple[str, ...] = ALL
    trap: tuple[tuple[str, Any], ...] = ()
    days_apart: bool = False


def _pushing(**subject: Any) -> tuple[tuple[str, Any], ...]:
    return (("subject", replace(AT_REST, **subject)),)


SOUND = (Case("perturbation recorded"), Case("perturbation not recorded", MOTION))
TRAPS = (
    Case("pushing 0.2 N·m", MOTION, _pushing(voluntary_nm=0.2)),
    Case("tremor 0.15 N·m", MOTION, _pushing(tremor_nm=0.15)),
    Case("drifting K", MOTION, _pushing(stiffness="drift", stiffness_depth=0.6)),
    Case("drifting K, perturbation recorded", ALL,
         _pushing(stiffness="drift", stiffness_depth=0.6)),
    Case("pushing, perturbation recorded", ALL, _pushing(voluntary_nm=0.2)),
    Case("J 15 % larger", ALL, (("factors", (1.15, 1.0, 1.0)),)),
    Case("degrees as radians", ALL, (("degrees", True), ("perturbation_nm", 0.3))),
    Case("DBS on later days, K 20 % lower then", ALL, (("factors", (1.0, 1.0, 0.8)),), True),
)  # fmt: skip


def case_of(number: int) -> Case:
    """Return the case of a study: regular and trapped in turn."""
    cases = TRAPS if number % 2 else SOUND
    return cases[number // 2 % len(cases)]


def sessions_of(number: int, *, lower: bool) -> list[Session]:
    """Return the sessions of a study, with a difference or without."""
    case = case_of(number)
    trap = dict(case.trap)
    rng = np.random.default_rng(np.random.SeedSequence([number, lower]))
    found = []
    for k in range(DAYS):
        day = DAY_SD * rng.standard_normal(3)
        for condition in ("OFF", "DBS"):
            factors = np.exp(day + OWN_SD * rng.standard_normal(3))
            session = Session(str(k + 1), condition, columns=case.columns)
            if condition == "DBS":
                factors *= [1.0, LOWER, LOWER] if lower else 1.0
                factors *= trap.get("factors", 1.0)
                session = replace(session, **{n: v for n, v in trap.items() if n != "factors"})
                if case.days_apart:
                    session = replace(session, day=str(DAYS + k + 1))
            if "perturbation_nm" in trap:
                session = replace(session, perturbation_nm=trap["perturbation_nm"])
            found.append(replace(session, factors=tuple(factors.tolist())))
    return found


def study_row(number: int, *, lower: bool) -> dict[str, Any]:
    """Return the verdicts on a study, by the rule and by p alone."""
    with TemporaryDirectory() as folder:
        seed = 2 * number + lower
        path = write_study(Path(folder) / "study", sessions_of(number, lower=lower), seed)
        result = rm.compare(path, resamples=0)
    concluded = conclude(result)
    assert concluded is not None
    now, before = {}, {}
    for one in concluded.each:
        name = MEASURES[one.comparison.measure.name]
        now[name] = one.verdict
        days = one.comparison.days
        p = one.comparison.days_p_holm
        side = "lower" if days is not None and days.estimate > 0 else "higher"
        before[name] = side if p < LEVEL else "no difference shown"
        if not np.isfinite(p):
            before[name] = "cannot be decided"
    reasons = {MEASURES[one.comparison.measure.name]: one.reason for one in concluded.each}
    return {"number": number, "lower": lower, "now": now, "before": before, "reasons": reasons}


def run(path: Path, studies: int, seconds: float) -> None:
    """Append studies that are not in the file yet, until the time is over."""
    done = {(row["number"], row["lower"]) for row in rows_of(path)}
    until = time.process_time() + seconds
    for number in range(studies):
        for lower in (False, True):
            if (number, lower) not in done and time.process_time() < until:
                row = study_row(number, lower=lower)
                with path.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row, ensure_ascii=False) + "\n")
                done.add((number, lower))
    print(f"{len(done)} of {2 * studies} studies, {time.process_time() - until + seconds:.0f} s")


def rows_of(path: Path) -> list[dict[str, Any]]:
    """Return the studies of a file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def outcome(verdict: str, name: str, *, lower: bool) -> str:
    """Return what a verdict is worth."""
    truth = "lower" if lower and name != "J" else "no difference shown"
    if verdict == truth:
        return "right"
    if verdict in ("not supported", "cannot be decided"):
        return "withheld"
    return "missed" if verdict == "no difference shown" else "wrong"


def table(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the shares of the outcomes as a table of Markdown."""
    yield "| studies | measure | " + " | ".join(f"{o}, before → now" for o in OUTCOMES) + " |"
    yield "| --- | --- |" + " ---: |" * len(OUTCOMES)
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        trapped = row["number"] % 2
        truth = "with" if row["lower"] else "without"
        groups.setdefault(f"{'trapped' if trapped else 'regular'}, {truth}", []).append(row)
    for row in rows:
        truth = "with" if row["lower"] else "without"
        groups.setdefault(f"{case_of(row['number']).name}, {truth}", []).append(row)
    for group, own in groups.items():
        for name in MEASURES.values():
            shares = []
            for key in ("before", "now"):
                counts = Counter(outcome(r[key][name], name, lower=r["lower"]) for r in own)
                shares.append([100 * counts[o] / len(own) for o in OUTCOMES])
            cells = [f"{b:.0f} → {n:.0f}" for b, n in zip(*shares, strict=True)]
            yield f"| {group} difference ({len(own)}) | {name} | {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("what", choices=("run", "table"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--studies", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=150.0)
    chosen = parser.parse_args()
    if chosen.what == "run":
        run(chosen.file, chosen.studies, chosen.seconds)
    else:
        print("\n".join(table(rows_of(chosen.file))))


if __name__ == "__main__":
    main()
