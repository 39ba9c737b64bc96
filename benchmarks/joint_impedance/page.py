"""The page of the documentation: the table, and a summary that is computed from it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.joint_impedance.recordings import RECORDINGS, SCENARIOS
from benchmarks.joint_impedance.score import HEADING, OFF, Score, cells

OURS = "rigidimeter"
COVERS = 0.80
"""Below it the intervals are too short, with allowance for chance."""

Scores = Mapping[str, Mapping[str, Score]]
"""By package and scenario."""


def table(scores: Scores) -> list[str]:
    """Return the rows of all packages, scenario by scenario, as Markdown."""
    lines = [
        "| scenario | package | " + " | ".join(HEADING) + " |",
        "| --- | --- |" + " ---: |" * len(HEADING),
    ]
    for scenario in SCENARIOS:
        for package, own in scores.items():
            if scenario in own:
                line = " | ".join((scenario, package, *cells(own[scenario])))
                lines.append(f"| {line} |")
    return lines


def summary(scores: Scores) -> list[str]:
    """Return a table with a row for each package, and sentences on where ours falls short."""
    lines = [
        "| package | scenarios with a bias up to 10 % | intervals that cover at least 80 % | "
        "recordings off, no caution (%) |",
        "| --- | ---: | ---: | ---: |",
    ]
    for package, own in scores.items():
        n = len(own)
        within = sum(not _off(score) for score in own.values())
        stated = [s.coverage for s in own.values() if np.isfinite(s.coverage).all()]
        covered = f"{sum((c >= COVERS).all() for c in stated)} of {n}" if stated else "none stated"
        silent = np.mean([score.silent for score in own.values()])
        lines.append(f"| {package} | {within} of {n} | {covered} | {100 * silent:.1f} |")
    return [*lines, "", *(f"- {line}" for line in _short_of(scores))]


def _short_of(scores: Scores) -> list[str]:
    """Say where ours is off, overconfident, silent or worse than another."""
    own = scores.get(OURS, {})

    def where(names: list[str]) -> str:
        return ", ".join(f"*{name}*" for name in names) or "no scenario"

    worse = [
        f"{name} ({best} {100 * _largest(scores[best][name]):.1f}, "
        f"{OURS} {100 * _largest(score):.1f})"
        for name, score in own.items()
        for best in [
            min(
                (one for one in scores if name in scores[one]),
                key=lambda one, name=name: _largest(scores[one][name]),  # type: ignore[misc]
            )
        ]
        if best != OURS
    ]
    cautions = [
        f"{name} ({100 * score.caution:.0f}, {100 * score.withheld:.0f})"
        for name, score in own.items()
        if score.caution or score.withheld
    ]
    return [
        f"{OURS} is off by more than 10 % in {where([n for n, s in own.items() if _off(s)])}.",
        f"Its intervals cover less than 80 % in "
        f"{where([n for n, s in own.items() if (s.coverage < COVERS).any()])}.",
        "It states a caution or withholds (% of the recordings) in "
        + (", ".join(cautions) or "no scenario") + ".",
        "Another package has the smaller largest bias (%) in "
        + (", ".join(worse) or "no scenario") + ".",
    ]  # fmt: skip


def _largest(score: Score) -> float:
    bias = np.abs(score.bias)
    return float(bias.max()) if np.isfinite(bias).all() else float("inf")


def _off(score: Score) -> bool:
    return not _largest(score) <= OFF


def page(scores: Scores) -> str:
    """Return the page."""
    return "\n".join([_INTRODUCTION, *summary(scores), "", _READING, *table(scores), ""])


_INTRODUCTION = f"""\
# Benchmark of joint impedance

How well packages estimate J, B and K of a joint, on {len(SCENARIOS)} scenarios of {RECORDINGS}
simulated recordings each. What they are, the rules, and how to add a package are in the data sheet,
`benchmarks/joint_impedance/README.md`, beside
[the truth](../../benchmarks/joint_impedance/truth.csv) and
[the scoring](../../benchmarks/joint_impedance/score.py). This page is written by

```sh
python -m benchmarks.joint_impedance --packages
```

`lstsq` is the regression of the torque on acceleration, velocity and angle, all behind the same
filter; `statsmodels` is the same with the intervals of Newey and West (`OLS`, `HAC`), and
`statsmodels-iv` the same with the perturbation of the last half second as instruments (`IV2SLS`).
`sippy-unipi` is an ARMAX model from torque to angle, `nfoursid` a subspace model from the
perturbation to torque and angle; both give J, B and K by their frequency response and state no
intervals of them. None is made for joints, and one who knows a scenario may do better with each.
The authors of `rigidimeter` chose the scenarios and set up the other packages; better set-ups are
welcome.
"""

_READING = f"""\
Three numbers in a cell are J, B and K, in % of the truth: bias is the median error, scatter half of
the distance between the 16th and 84th percentile, coverage the share of 95 % intervals that hold
the truth, half-width the median one of these intervals. *Off, no caution*: recordings in which J, B
or K is off by more than 10 % and the package states no caution. The standard error of a share of
{RECORDINGS} recordings is up to {50 / RECORDINGS**0.5:.0f} %.
"""
