"""How often each test of a study finds a difference: where there is none, and where there is one.

Many virtual studies of the paper's design (`rigidimeter.virtual`): nine days in OFF, on four of
them in DBS too, the counts of Table 1. Every PRBS epoch runs on the compiled batch and is fitted as
`estimate` does it: instrumental variables, then again with J held at its median. Ticks are 200 a
second here, the sensors keep the paper's rates: the loop is the same, at a third of the time.

Impulse and work come from the recorded sinusoid of Eq. 3. That motion is imposed, so the torque,
band-passed, is linear in J, B and K, plus noise and voluntary torque; its parts come once from
`scoring_cycles` (noise: `NOISES` epochs of it), put together anew for each epoch. A check holds the
sum against `score_epoch`.

Studies are simulated with days that scatter, and dealt to the tests in four ways:

    day scatter       as they are: an offset a day, the same in OFF and DBS
    no day scatter    epochs dealt anew among all studies, within a condition: independent, with
                      the same variance in all
    days apart        days dealt anew, OFF and DBS for themselves: thirteen days, none in common
    session scatter   the same, but the four days still carry one name: what a study gets in which
                      OFF and DBS of one day are no more alike than those of two

`--deals` tests more studies than were simulated: whole days are dealt anew among the studies, each
to the same place of another. J is held at the median of the study in which an epoch was simulated;
DBS with an effect is made for every fourth study.

    python -m benchmarks.null_studies --studies 1000 --keep null.npz
"""

from __future__ import annotations

import argparse
import math
import operator
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import (
    estimate_recorded,
    loop_area_j,
    prepare,
    score_epoch,
    scoring_cycles,
)
from rigidimeter.analysis.statistics import (
    day_difference,
    difference,
    exact_ranksum,
    fit_mixed,
    ranksum,
)
from rigidimeter.core.executor import each
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import Settings, SubjectSettings, parse_settings
from rigidimeter.model import JointDynamics, SubjectTorque, draw_joint
from rigidimeter.paper import imposed_epoch
from rigidimeter.virtual import (
    NULL,
    PAPER,
    PAPER_RATES,
    DayPlan,
    StudyDesign,
    day_factors,
    day_joint,
    draw_ratings,
    plan_study,
)
from rigidimeter.virtual.batch import simulate_epochs

Array = NDArray[np.float64]

MEASURES = ("J", "B", "K", "impulse", "work")
TICKS_HZ = 200.0
NOISES = 400
EVERY = 16  # of the 4096 points a cycle of the scores: 256 do for a mean of |M|
AS_SCORED = 2e-4
PRBS, SINUSOID = 1, 2
EFFECT_EVERY = 4
SAVE_EVERY = 20
DEALING = 11
RATINGS = 3
LEVEL = 0.05
WAYS = ("no day scatter", "day scatter", "days apart", "session scatter")
TESTS = (
    "rank-sum of epochs (paper)",
    "by days",
    "rank-sum of day medians",
)
RATING_TESTS = (
    "F, (1\\|examiner), residual df (paper)",
    "F, (1\\|examiner), Kenward-Roger",
    "F, (1\\|examiner) + (1\\|day), Kenward-Roger",
    "rank-sum of day medians",
)


def bench_settings() -> Settings:
    """Return the settings of every epoch; the subjects are given with each."""
    rig = {**PAPER_RATES, "tick_rate_hz": TICKS_HZ}
    return parse_settings({"rig": rig})


class Scorer:
    """Scores of the imposed sinusoid, from the parts of its torque.

    Parameters
    ----------
    settings : Settings
    subject : SubjectSettings
        For the voluntary torque.
    seed : int
    """

    def __init__(self, settings: Settings, subject: SubjectSettings, seed: int) -> None:
        self.settings, self.subject = settings, subject
        self.n = settings.scores.cycles
        base = (0.0045, 0.13, 1.5)
        nominal = self._torque(imposed_epoch(JointDynamics(*base), settings))
        self.parts = []
        for index in range(3):
            doubled = [2.0 * value if k == index else value for k, value in enumerate(base)]
            more = self._torque(imposed_epoch(JointDynamics(*doubled), settings))
            self.parts.append((more - nominal) / base[index])
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(SINUSOID,)))
        self.noise = np.array([self._noise(base, nominal, rng) for _ in range(NOISES)])
        self._check(rng)

    def _torque(self, epoch: Epoch) -> Array:
        cycles = scoring_cycles(epoch, self.settings.scores)
        self.angle = cycles.angle_rad[::EVERY]
        self.interval_s = EVERY * float(cycles.time_s[1] - cycles.time_s[0])
        return cycles.torque_nm[::EVERY]

    def _noise(self, base: Sequence[float], nominal: Array, rng: np.random.Generator) -> Array:
        """Return what the subject's own torque and the noise of the sensor add to the torque."""
        epoch, rig = imposed_epoch(JointDynamics(*base), self.settings), self.settings.rig
        ticks = round(self.settings.sinusoid.duration_s * rig.tick_rate_hz)
        voluntary = SubjectTorque(self.subject, rig.tick_rate_hz, rng).block(ticks)
        torque = epoch.channels["torque_nm"]
        noisy = torque.values - voluntary[:: round(rig.tick_rate_hz / rig.torque.rate_hz)]
        noisy = noisy + rig.torque.noise_sd_nm * rng.standard_normal(noisy.size)
        channels = {**epoch.channels, "torque_nm": replace(torque, values=noisy)}
        return self._torque(replace(epoch, channels=channels)) - nominal

    def scores(self, joint: JointDynamics, noise: Array) -> tuple[float, float]:
        """Return impulse in N·m·s and work in J, a cycle."""
        T_J, T_B, T_K = self.parts
        torque = (
            joint.inertia_kg_m2 * T_J
            + joint.damping_nm_s_rad * T_B
            + joint.stiffness_nm_rad * T_K
            + noise
        )
        return (
            float(np.sum(np.abs(torque[:-1]))) * self.interval_s / self.n,
            loop_area_j(torque, self.angle) / self.n,
        )

    def drawn(self, subject: SubjectSettings, rng: np.random.Generator) -> tuple[float, float]:
        """Return the scores of one epoch of a subject."""
        sign = 1.0 if rng.random() < 0.5 else -1.0
        return self.scores(draw_joint(subject, rng), sign * self.noise[rng.integers(NOISES)])

    def _check(self, rng: np.random.Generator) -> None:
        joint = JointDynamics(0.005, 0.11, 1.9)
        wanted = score_epoch(
            imposed_epoch(joint, self.settings), self.settings.scores, self.settings.estimation
        )
        found = self.scores(joint, np.zeros(self.angle.size))
        for ours, theirs in zip(found, (wanted.impulse_nm_s, wanted.work_j), strict=True):
            assert math.isclose(ours, theirs, rel_tol=AS_SCORED), (ours, theirs)


_SCORER: list[Scorer] = []


def simulate_study(seed: int) -> dict[str, Array]:
    """Return every estimate of one study, by condition and measure, in the order of the sessions.

    OFF and DBS have no difference; ``effect`` is DBS with the joint of the paper's design on the
    same days, made for every `EFFECT_EVERY`-th study.
    """
    settings = bench_settings()
    null = plan_study(NULL, seed)
    if not _SCORER:
        _SCORER.append(Scorer(settings, null[0].settings.subject["OFF"], 1))
    parts = [("OFF", _of(null, "OFF")), ("DBS", _of(null, "DBS"))]
    found = _estimates(settings, parts, seed)
    if seed % EFFECT_EVERY == 0:
        effect = [parts[0], ("effect", _of(plan_study(PAPER, seed), "DBS"))]
        found = _estimates(settings, effect, seed) | found
    return found


def _estimates(
    settings: Settings,
    parts: Sequence[tuple[str, list[DayPlan]]],
    seed: int,
) -> dict[str, Array]:
    """Simulate the epochs of conditions together, and estimate them as `estimate` does."""
    key = sum(map(ord, parts[0][0]))
    names, subjects = [], []
    for name, plans in parts:
        for subject, count in _epochs(plans, "prbs"):
            names += [name] * count
            subjects += [subject] * count
    batch = simulate_epochs(
        settings,
        len(subjects),
        conditions=["OFF" if name == "OFF" else "DBS" for name in names],
        subjects=subjects,
        seed=int(np.random.SeedSequence(seed, spawn_key=(PRBS, key)).generate_state(1)[0]),
    )
    epochs = [batch.epoch(i) for i in range(len(batch))]
    recorded = prepare(epochs, settings, clocks=False)
    analysis = estimate_recorded(recorded, "iv", fits_alone=True)
    first, second = analysis.fits, analysis.fixed_inertia
    assert all(fit.outcome.included for fit in (*first, *second))
    found = {}
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(SINUSOID, key)))
    for name, plans in parts:
        own = [place for place, whose in enumerate(names) if whose == name]
        found[f"{name} J"] = np.array([first[i].inertia_kg_m2 for i in own])
        found[f"{name} B"] = np.array([second[i].damping_nm_s_rad for i in own])
        found[f"{name} K"] = np.array([second[i].stiffness_nm_rad for i in own])
        scores = [
            _SCORER[0].drawn(subject, rng)
            for subject, count in _epochs(plans, "sinusoid")
            for _ in range(count)
        ]
        found[f"{name} impulse"], found[f"{name} work"] = np.array(scores).T
    return found


def _of(plans: Sequence[DayPlan], condition: str) -> list[DayPlan]:
    return [plan for plan in plans if plan.condition == condition]


def _epochs(plans: Sequence[DayPlan], task: str) -> Iterator[tuple[SubjectSettings, int]]:
    for plan in plans:
        for block in plan.settings.protocol.blocks:
            if block.task == task:
                yield plan.settings.subject[plan.condition], block.epochs


def days_of(design: StudyDesign, condition: str, task: str) -> NDArray[np.int64]:
    """Return the day of each epoch of a condition, in the order of its sessions."""
    return np.array(
        [
            int(plan.day)
            for plan in _of(plan_study(design, 0), condition)
            for block in plan.settings.protocol.blocks
            if block.task == task
            for _ in range(block.epochs)
        ]
    )


def simulate_studies(studies: int, processes: int, keep: Path | None = None) -> dict[str, Array]:
    """Return the estimates of many studies, one row each; the seeds go from 0 on.

    What is done is kept in a file every so often, and is not done again.
    """
    rows: list[dict[str, Array]] = []
    if keep is not None and keep.exists():
        rows = _unstacked(dict(np.load(keep)))[:studies]
    start_s, before = time.monotonic(), len(rows)
    seeds = range(before, studies)
    for _, row in each(simulate_study, seeds, jobs=processes, in_order=True):
        rows.append(row)
        if len(rows) % SAVE_EVERY == 0 or len(rows) == studies:
            spent_s = time.monotonic() - start_s
            left_s = spent_s / (len(rows) - before) * (studies - len(rows))
            print(f"{len(rows)} studies, {spent_s:.0f} s, {left_s:.0f} s left", flush=True)
            if keep is not None:
                part = keep.with_name(f".{keep.name}")
                np.savez(part.with_suffix(".part.npz"), **_stacked(rows))
                part.with_suffix(".part.npz").replace(keep)
    return _stacked(rows)


def _stacked(rows: Sequence[dict[str, Array]]) -> dict[str, Array]:
    """Return one array for each column; those of ``effect`` have fewer rows."""
    return {name: np.array([row[name] for row in rows if name in row]) for name in rows[0]}


def _unstacked(columns: dict[str, Array]) -> list[dict[str, Array]]:
    studies = len(columns["OFF J"])
    return [
        {
            name: values[seed // EFFECT_EVERY if name.startswith("effect") else seed]
            for name, values in columns.items()
            if not (name.startswith("effect") and seed % EFFECT_EVERY)
        }
        for seed in range(studies)
    ]


class Dealt(NamedTuple):
    """One study as a test sees it: values of two conditions and the day of each."""

    x: Array
    x_days: NDArray[np.str_]
    y: Array
    y_days: NDArray[np.str_]


def deals(
    estimates: Mapping[str, Array], measure: str, other: str, way: str, studies: int
) -> Iterator[Dealt]:
    """Yield so many studies, dealt from those that were simulated.

    A day of a study is moved as a whole, to the same place in another. With as many studies as
    were simulated, ``day scatter`` gives them as they are.
    """
    task = "prbs" if measure in ("J", "B", "K") else "sinusoid"
    x, y = estimates[f"OFF {measure}"], estimates[f"{other} {measure}"]
    if other == "effect":
        x = x[::EFFECT_EVERY][: len(y)]
    x_days, y_days = (days_of(NULL, name, task) for name in ("OFF", "DBS"))
    apart = way == "days apart"
    x_names = x_days.astype(str)
    y_names = np.char.add(y_days.astype(str), "′" if apart else "")
    rng = np.random.default_rng(DEALING)
    rows = len(x)
    for start in range(0, studies, rows):
        first, second = x, y
        if way == "no day scatter":
            first, second = (rng.permutation(v.ravel()).reshape(v.shape) for v in (x, y))
        elif way != "day scatter" or start > 0:
            first, second = x.copy(), y.copy()
            for day in np.unique(x_days):
                order = rng.permutation(rows)
                first[:, x_days == day] = x[order][:, x_days == day]
                if way != "day scatter":  # DBS of another day than OFF
                    order = rng.permutation(rows)
                second[:, y_days == day] = y[order][:, y_days == day]
        for row in range(min(rows, studies - start)):
            yield Dealt(first[row], x_names, second[row], y_names)


def found_by(study: Dealt) -> tuple[bool, ...]:
    """Return whether each test of `TESTS` finds a difference."""
    days = study.x_days.tolist(), study.y_days.tolist()
    test = day_difference(study.x, study.y, *days)
    p_epochs = ranksum(study.x, study.y).p
    return tuple(p < LEVEL for p in (p_epochs, test.p, test.p_days))


def rated(design: StudyDesign, seed: int, *, scatter: bool) -> tuple[bool, ...]:
    """Return whether each test of `RATING_TESTS` finds a difference between the ratings."""
    if not scatter:
        design = replace(
            design,
            day_inertia_cv_percent=0.0,
            day_damping_cv_percent=0.0,
            day_stiffness_cv_percent=0.0,
        )
    joints, days, names = [], [], []
    for condition in design.conditions:
        for day in condition.days:
            joints.append(day_joint(design, condition, day_factors(design, seed, day)))
            days.append(str(day))
            names.append(condition.name)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(RATINGS,)))
    rows = [
        (name, day, examiner, score)
        for name, day, ratings in zip(names, days, draw_ratings(design, joints, rng), strict=True)
        for examiner, score in ratings.items()
    ]
    conditions, of_day, examiners, scores = (list(column) for column in zip(*rows, strict=True))
    without = difference(fit_mixed(scores, conditions, {"examiner": examiners}), "OFF", "DBS")
    groups = {"examiner": examiners, "day": of_day}
    with_day = difference(fit_mixed(scores, conditions, groups), "OFF", "DBS")
    medians = {
        name: [
            float(np.median([row[3] for row in rows if row[:2] == (name, day)]))
            for other, day in zip(names, days, strict=True)
            if other == name
        ]
        for name in ("OFF", "DBS")
    }
    return (
        without.p_residual < LEVEL,
        without.p_kenward_roger < LEVEL,
        with_day.p_kenward_roger < LEVEL,
        exact_ranksum([(medians["OFF"], medians["DBS"])]) < LEVEL,
    )


def table(title: str, tests: Sequence[str], rows: Mapping[str, Sequence[tuple[bool, ...]]]) -> str:
    """Return shares in percent as a table of Markdown."""
    lines = [f"| {title} | " + " | ".join(tests) + " |", "| --- |" + " ---: |" * len(tests)]
    for name, found in rows.items():
        shares = 100.0 * np.mean(np.array(found, dtype=np.float64), axis=0)
        lines.append(f"| {name} | " + " | ".join(f"{share:.1f}" for share in shares) + " |")
    return "\n".join(lines)


def found_in(
    estimates: Mapping[str, Array], measure: str, other: str, way: str, studies: int
) -> list[tuple[bool, ...]]:
    return [found_by(study) for study in deals(estimates, measure, other, way, studies)]


def rated_in(design: StudyDesign, scatter: bool, studies: int) -> list[tuple[bool, ...]]:
    return [rated(design, seed, scatter=scatter) for seed in range(studies)]


def tables(
    estimates: Mapping[str, Array], studies: int, processes: int
) -> Iterator[tuple[str, str]]:
    """Yield every table with the name of what it shows."""
    shown = [("No difference", "DBS", way) for way in WAYS]
    shown += [("B 0.1368 → 0.119, K 1.751 → 1.44", "effect", way) for way in WAYS[:3]]
    designs = {"no difference": NULL, "the difference above": PAPER}
    ours = {
        measure: {k: v for k, v in estimates.items() if k.endswith(f" {measure}")}
        for measure in MEASURES
    }
    tests = (
        partial(found_in, ours[measure], measure, other, way, studies)
        for _, other, way in shown
        for measure in MEASURES
    )
    rated_designs = {
        f"{name}, {'day scatter' if scatter else 'no day scatter'}": partial(
            rated_in, design, scatter, studies
        )
        for name, design in designs.items()
        for scatter in (False, True)
    }
    pieces = chain(tests, rated_designs.values())
    found = (result for _, result in each(operator.call, pieces, jobs=processes, in_order=True))
    for title, _, way in shown:
        yield (
            f"{title}, {way}",
            table("Measure", TESTS, dict(zip(MEASURES, islice(found, len(MEASURES)), strict=True))),
        )
    yield (
        "Ratings",
        table(
            "Scores of three examiners", RATING_TESTS, dict(zip(rated_designs, found, strict=True))
        ),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--studies", type=int, default=1000)
    parser.add_argument("--deals", type=int, help="studies to test; as many as simulated")
    parser.add_argument("--processes", type=int, default=2, choices=(1, 2))
    parser.add_argument("--keep", type=Path, help="file of the estimates; goes on where it ended")
    parser.add_argument("--out", type=Path, help="write the tables there as well")
    chosen = parser.parse_args()
    estimates = simulate_studies(chosen.studies, chosen.processes, chosen.keep)
    simulated = len(estimates["OFF J"])
    wanted = chosen.deals or simulated
    print(f"{simulated} studies simulated, {wanted} tested; shares of p < {LEVEL} in percent")
    parts = []
    for title, text in tables(estimates, wanted, chosen.processes):
        print(f"\n{title}\n\n{text}", flush=True)
        parts.append(f"### {title}\n\n{text}\n")
    if chosen.out is not None:
        chosen.out.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    from benchmarks import null_studies  # whose functions a process can import

    null_studies.main()
