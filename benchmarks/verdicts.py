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

Many more studies are drawn as values of B and K, without recordings, and concluded upon by the same
code (`STUDIES`): without a difference, with one (`TRUE`), and with one of the size that is worth
finding, of which none may be excluded. The chance that `rigidimeter design` predicts stands beside.

    python -m benchmarks.verdicts days --studies 2000   # 40 minutes of processor time
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from tests.traps.recorded_studies import ALL, AT_REST, MOTION, Session, write_study

import rigidimeter as rm
from rigidimeter.analysis.study import LEVEL, as_rows, conclude, day_tests
from rigidimeter.analysis.study import MEASURES as TESTED
from rigidimeter.analysis.study import Study as Rows
from rigidimeter.core.study_files import PrimaryTable
from rigidimeter.planning import Scatter, day_difference_sd, paired_power

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
    now, before = {}, {}
    for one in result.comparisons:
        name = MEASURES[one.measure.name]
        now[name] = one.verdict
        side = "lower" if one.sign < 0 else "higher"
        before[name] = side if one.p_adjusted < LEVEL else "no difference shown"
        if not one.tested:
            before[name] = "cannot be decided"
    reasons = {MEASURES[one.measure.name]: one.reason for one in result.comparisons}
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


EPOCHS = 5
"""Of a day and condition."""
WILD = (1 / 3, 3.0)
SCATTER = {
    "stiffness_nm_rad": Scatter(16.0, 10.0, 6.0, "measured"),
    "damping_nm_s_rad": Scatter(12.0, 7.5, 4.5, "three quarters of it, as in Table 2"),
}
TRUE = {"stiffness_nm_rad": 0.18, "damping_nm_s_rad": 0.13}
WORTH = dict.fromkeys(TRUE, PrimaryTable().difference_percent / 100.0)
FOUND, NONE = ("lower", "higher"), ("no difference shown",)
OTHERS = ("not supported",), NONE, ("cannot be decided",)


class Concluded(NamedTuple):
    """What is concluded of a measure, whether its interval holds the difference, and that share."""

    verdict: str
    held: bool
    lower: float


@dataclass(frozen=True)
class Study:
    """Days with epochs of two conditions, and what is wrong with them.

    Attributes
    ----------
    name : str
    off, dbs : range
        Days of each condition; a number in both is one day.
    subjects : int
        Each with these days. Of several the difference is not the same: SD half of it.
    wild : float
        Share of epochs whose value is three times too high or too low.
    high : float
        How much the first day of OFF is too high, as a share.
    """

    name: str
    off: range
    dbs: range
    subjects: int = 1
    wild: float = 0.0
    high: float = 0.0

    def drawn(
        self, name: str, lower: float, rng: np.random.Generator
    ) -> tuple[list[dict[str, Any]], float]:
        """Return the rows of a measure that is lower in DBS by a share, and that share.

        Of one or two subjects it is theirs, else that of all, as the sentence speaks of them.
        """
        scatter = SCATTER[name]
        epochs, days, own = (
            percent / 100.0
            for percent in (
                scatter.between_epochs_percent,
                scatter.between_days_percent,
                scatter.condition_in_day_percent,
            )
        )
        found, effects = [], []
        for subject in range(self.subjects):
            effect = lower
            if self.subjects > 1:
                effect *= 1 + scatter.between_subjects * rng.standard_normal()
            effects.append(effect)
            of_days = days * rng.standard_normal(max(self.off.stop, self.dbs.stop))
            for condition, level, recorded in (
                ("OFF", 1.0, self.off),
                ("DBS", 1.0 - effect, self.dbs),
            ):
                for day in recorded:
                    mean = 1 + of_days[day] + own * rng.standard_normal()
                    values = level * (mean + epochs * rng.standard_normal(EPOCHS))
                    hit = rng.random(EPOCHS) < self.wild
                    values[hit] *= rng.choice(WILD, int(hit.sum()))
                    if condition == "OFF" and day == recorded.start:
                        values *= 1 + self.high
                    row = {
                        "subject": f"S{subject}",
                        "day": f"{day}",
                        "unit": f"{subject}/{day}",
                        "condition": condition,
                        "method": "simulated",
                        "measure": name,
                    }
                    found += [row | {"value": value} for value in values.tolist()]
        return found, math.fsum(effects) / len(effects) if self.subjects < 3 else lower

    def predicted(self, name: str) -> float:
        """Return the chance of which `design` speaks; NaN where it plans no such study."""
        lower, scatter = TRUE[name], SCATTER[name]
        sd = day_difference_sd(scatter, (1.0, 1.0 - lower), (0.0, 0.0), (EPOCHS, EPOCHS))
        days, level = len(self.off), PrimaryTable().first_level(LEVEL)
        if self.off != self.dbs or max(days, self.subjects) < 3 or self.subjects == 2:
            return math.nan
        if self.subjects == 1:
            return paired_power(lower, sd, days, alpha=level)
        of_subject = math.hypot(scatter.between_subjects * lower, sd / math.sqrt(days))
        return paired_power(lower, of_subject, self.subjects, alpha=level)

    def concluded(self, lower: Mapping[str, float], seed: Sequence[int]) -> dict[str, Concluded]:
        """Draw and compare a study; return what is concluded of each measure."""
        rng = np.random.default_rng(seed)
        rows: list[dict[str, Any]] = []
        shares = {}
        for measure in TESTED:
            if measure.name in lower:
                seen, shares[measure.name] = self.drawn(measure.name, lower[measure.name], rng)
                rows += seen
        study = Rows(as_rows(rows), "OFF", "DBS")
        level = 1 + self.wild * (sum(WILD) / len(WILD) - 1)
        found = {}
        for one in conclude(study, day_tests(study)):
            name = one.measure.name
            held = one.low <= -level * shares[name] <= one.high
            found[name] = Concluded(one.verdict, held, shares[name])
        return found


STUDIES = (
    Study("2 days", range(2), range(2)),
    Study("3 days", range(3), range(3)),
    Study("5 days", range(5), range(5)),
    Study("8 days", range(8), range(8)),
    Study("9 + 4 days", range(9), range(9, 13)),
    Study("9 days, 4 with both", range(9), range(4)),
    Study("2 subjects, 3 days", range(3), range(3), subjects=2),
    Study("4 subjects, 3 days", range(3), range(3), subjects=4),
    Study("8 days, 5 % wild epochs", range(8), range(8), wild=0.05),
    Study("8 days, one 60 % too high", range(8), range(8), high=0.6),
)


def shares(found: Sequence[Concluded], *verdicts: Sequence[str]) -> str:
    """Return how many per cent have one of these verdicts, for each group of them."""
    counts = [sum(one.verdict in group for one in found) for group in verdicts]
    return " / ".join(f"{100 * count / len(found):.1f}" for count in counts)


def of_days(studies: int, only: str) -> Iterator[str]:
    """Yield the table of verdicts on days of epochs, of the rows whose names hold some text."""
    others = "not supported / no difference / undecided"
    yield (
        f"| studies | | either found, none there | none there: found / {others} | lower by 18 % "
        f"(K), 13 % (B): lower / higher / {others} | planned | lower by 20 %: no difference | "
        "interval holds |"
    )
    yield "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    for k, study in enumerate(STUDIES):
        if only not in study.name:
            continue
        none, true, worth = (
            [study.concluded(lower, [k, way, n]) for n in range(studies)]
            for way, lower in enumerate((dict.fromkeys(TRUE, 0.0), TRUE, WORTH))
        )
        either = [any(one.verdict in FOUND for one in each.values()) for each in none]
        for name in TRUE:
            absent, there, at = ([each[name] for each in part] for part in (none, true, worth))
            at = [one for one in at if one.lower >= WORTH[name]]
            held = [one.held for one in (*absent, *there)]
            planned = 100 * study.predicted(name)
            cells = [
                f"{100 * sum(either) / studies:.1f}",
                shares(absent, FOUND, *OTHERS),
                shares(there, ("lower",), ("higher",), *OTHERS),
                "–" if math.isnan(planned) else f"{planned:.0f}",
                shares(at, NONE),
                f"{100 * sum(held) / len(held):.1f}" if any(held) else "–",
            ]
            yield f"| {study.name} | {MEASURES[name]} | {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("what", choices=("run", "table", "days"))
    parser.add_argument("file", type=Path, nargs="?", default=Path("verdicts.jsonl"))
    parser.add_argument("--studies", type=int, default=200)
    parser.add_argument("--only", default="", help="of the rows of days")
    parser.add_argument("--seconds", type=float, default=150.0)
    chosen = parser.parse_args()
    if chosen.what == "days":
        for line in of_days(chosen.studies, chosen.only):
            print(line, flush=True)
    elif chosen.what == "run":
        run(chosen.file, chosen.studies, chosen.seconds)
    else:
        print("\n".join(table(rows_of(chosen.file))))


if __name__ == "__main__":
    main()
