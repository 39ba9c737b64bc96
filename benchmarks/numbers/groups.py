"""The groups of numbers: which commands are run on which inputs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from benchmarks.numbers.documents import (
    BRIEF,
    Numbers,
    comparisons_numbers,
    design_numbers,
    estimates_numbers,
    ledger_numbers,
    models_numbers,
    ratings_numbers,
    session_numbers,
    study_numbers,
    table_comparison_numbers,
    tables_numbers,
)
from benchmarks.numbers.inputs import RATED, Workspace, shared_data

__all__ = ["GROUPS", "Absent", "Group"]

METHODS = ("iv", "spectral", "bandlimited", "published")
JBK = "inertia,damping,stiffness"
OFFSET = f"{JBK},offset"
PLANNED = """\
[subject.OFF]
damping_nm_s_rad = 0.1368
stiffness_nm_rad = 1.751
voluntary_sd_nm = {voluntary}
[subject.DBS]
damping_nm_s_rad = 0.115
stiffness_nm_rad = 1.42
"""
"""The joints of the designs."""
ANKLE = (
    *("--column", "angle_rad=position_rad", "--column", "torque_nm=torque_Nm"),
    *("--rate-hz", 1000, "--reaction"),
)
LEFT_OUT = ("provenance", "settings", "estimates")
"""Tables of a report: where and with what it was made, and what the estimates hold already."""


class Absent(Exception):
    """The recordings that a group needs are not here."""


class Group(NamedTuple):
    """What computes its numbers, and whether it takes minutes."""

    numbers: Callable[[Workspace], Numbers]
    slow: bool = False


def _named(parts: Mapping[str, Numbers]) -> Numbers:
    return {f"{part}/{name}": one for part, found in parts.items() for name, one in found.items()}


def simulation(work: Workspace) -> Numbers:
    """Return what the virtual rig records."""
    names = ("day-1", "elbow", "paper-rates", "pushing")
    return _named({name: session_numbers(work.folder / work.session(name)) for name in names})


def design(work: Workspace) -> Numbers:
    """Return what is foreseen of a protocol, and what a search finds."""
    relaxed = work.settings("design-relaxed", PLANNED.format(voluntary=0.0))
    pushing = work.settings("design-pushing", PLANNED.format(voluntary=0.1))
    wanted = ("--detect", "damping=20%", "--detect", "stiffness=0.3", "--multisine")
    planned = ("--settings", relaxed, *wanted)
    searched = ("--settings", pushing, "--optimise")
    return _named(
        {
            "plain": design_numbers(work.document("design", "design", *planned)),
            "searched": design_numbers(work.document("design-searched", "design", *searched)),
        }
    )


def estimate(work: Workspace) -> Numbers:
    """Return estimates and comparison of sessions of two conditions, by the usual method."""
    days = (work.session("day-1"), work.session("day-2"))
    found = {
        "days": estimates_numbers(work.document("estimate-days", "estimate", *days)),
        "compared": comparisons_numbers(work.document("compare-days", "compare", *days)),
    }
    for name in ("elbow", "paper-rates"):
        document = work.document(f"estimate-{name}", "estimate", work.session(name))
        found[name] = estimates_numbers(document)
    return _named(found)


def methods(work: Workspace) -> Numbers:
    """Return estimates of a subject who pushes, by every method."""
    session = work.session("pushing")
    found = {}
    for name in METHODS:
        document = work.document(f"estimate-{name}", "estimate", session, "--method", name)
        found[name] = estimates_numbers(document)
    return _named(found)


def study(work: Workspace) -> Numbers:
    """Return every conclusion of the small study, and the tables of its report."""
    folder = work.study()
    numbers = study_numbers(work.document("compare-study", "compare", folder))
    kept = work.folder / folder / "analysis" / "estimates.json"
    estimates = estimates_numbers(json.loads(kept.read_text(encoding="utf-8")))
    work.run("report-study", "report", folder, "--out", "report")
    tables = tables_numbers(work.folder / "report" / "tables", LEFT_OUT)
    return _named({"study": numbers, "estimates": estimates, "report": tables})


def columns(work: Workspace) -> Numbers:
    """Return comparisons of columns of a table."""
    days = (work.session("day-1"), work.session("day-2"))
    work.run("estimate-table", "estimate", *days, "--csv", "estimates.csv")
    measures = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
    values = [word for name in measures for word in ("--value", name)]
    rated = ("compare", work.ratings("crossed"), "--value", "score", "--session", "subject")
    return _named(
        {
            "estimates": table_comparison_numbers(
                work.document("compare-table", "compare", "estimates.csv", *values)
            ),
            "ratings": table_comparison_numbers(work.document("compare-ratings", *rated)),
        }
    )


def ratings(work: Workspace) -> Numbers:
    """Return the mixed model of every set of ratings."""
    found = {}
    for name, random in RATED.items():
        options = [word for one in random for word in ("--random", one)]
        scale = ("--scale", -10, 10, "--step", 0)
        document = work.document(f"ratings-{name}", "ratings", work.ratings(name), *options, *scale)
        found[name] = ratings_numbers(document)
    return _named(found)


def terms(work: Workspace) -> Numbers:
    """Return models of the torque of a relaxed subject and of one who pushes."""
    relaxed = ("model", work.session("paper-rates"), "--compare")
    pushing = ("model", work.session("pushing"), "--compare", *_terms(JBK, f"{JBK},cubic"))
    return _named(
        {
            "relaxed": models_numbers(work.document("model-relaxed", *relaxed)),
            # No model may be recommended, which the status says.
            "pushing": models_numbers(work.document("model-pushing", *pushing, statuses=(0, 1))),
        }
    )


def ankle(work: Workspace) -> Numbers:
    """Return estimates and models of a measured ankle."""
    folder = _shared() / "ankle"
    files = sorted(folder.glob("*.npz"))
    found = {}
    for name in ("auto", "bandlimited", "published"):
        options = (*ANKLE, "--epoch-length-s", 20, "--method", name)
        found[name] = estimates_numbers(
            work.document(f"ankle-{name}", "estimate", *files, *options)
        )
    reflexes = [OFFSET, f"{OFFSET},reflex-fir+", f"{OFFSET},reflex-second-order", f"{JBK},reflex"]
    compared = ("--band-hz", 0, 40, "--compare", *_terms(*reflexes))
    found["models"] = models_numbers(
        work.document("ankle-models", "model", *files, *ANKLE, *compared, statuses=(0, 1))
    )
    return _named(found)


def emps(work: Workspace) -> Numbers:
    """Return mass and friction of a positioning axis."""
    path = work.emps(_shared())
    models = (
        f"{JBK.removesuffix(',stiffness')},coulomb,offset",
        "inertia,directional-damping,directional-coulomb",
    )
    settings = work.settings("emps", "[estimation]\ntrim_s = 0.25")
    # Newtons stand for newton-metres, more than a limb's; so the unit has to be said.
    units = ("--unit", "torque=Nm")
    options = ("--rate-hz", 1000, "--band-hz", 0, 40, "--settings", settings, *units)
    return models_numbers(work.document("emps", "model", path, *options, *_terms(*models)))


def silverbox(work: Workspace) -> Numbers:
    """Return the cubic spring of a circuit, from both parts of its recording."""
    shared = _shared()
    found = {}
    settings = work.settings("silverbox", "[estimation]\ntrim_s = 0.5")
    units = ("--unit", "angle=rad")
    options = ("--rate-hz", 610.3516, "--band-hz", 0, 120, "--settings", settings, *units)
    for name, part in (("noise", slice(0, 40_000)), ("multisine", slice(40_800, None))):
        path = work.silverbox(shared, part)
        models = _terms(OFFSET, f"{OFFSET},quadratic,cubic")
        document = work.document(f"silverbox-{name}", "model", path, *options, *models)
        found[name] = models_numbers(document)
    return _named(found)


def full(work: Workspace) -> Numbers:
    """Return every conclusion of the virtual study of the paper's size."""
    folder = work.full_study()
    numbers = study_numbers(work.document("compare-full", "compare", folder))
    kept = work.folder / folder / "analysis" / "estimates.json"
    document: Any = json.loads(kept.read_text(encoding="utf-8"))
    return _named({"study": numbers, "estimates": estimates_numbers(document, BRIEF)})


def ledger(work: Workspace) -> Numbers:
    """Return the paper's numbers as they are computed."""
    work.run("reproduce", "reproduce", "--out", "paper")
    text = (work.folder / "paper" / "ledger.json").read_text(encoding="utf-8")
    return ledger_numbers(json.loads(text))


def _shared() -> Any:
    folder = shared_data()
    if folder is None:
        raise Absent("the real recordings are not here; RIGIDIMETER_SHARED names their folder")
    return folder


def _terms(*models: str) -> list[str]:
    return [word for model in models for word in ("--terms", model)]


GROUPS: Mapping[str, Group] = {
    "simulation": Group(simulation),
    "design": Group(design),
    "estimate": Group(estimate),
    "methods": Group(methods),
    "study": Group(study),
    "columns": Group(columns),
    "ratings": Group(ratings),
    "terms": Group(terms),
    "ankle": Group(ankle),
    "emps": Group(emps),
    "silverbox": Group(silverbox),
    "full": Group(full, slow=True),
    "ledger": Group(ledger, slow=True),
}
