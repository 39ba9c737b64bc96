"""`rigidimeter design`: what will be commanded, and what to expect of it, before any hardware."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.cli.help_pages import DETECT, PERTURB, WRITE
from rigidimeter.cli.options import JSON, SETTINGS
from rigidimeter.cli.output import echo, keep_inputs, say
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import plain_recordings
from rigidimeter.cli.terminal_tables import show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.core.study_files import PrimaryTable
    from rigidimeter.planning import Scatter


def design(
    settings: Path | None = SETTINGS,
    out: Path | None = WRITE.option(
        "--out DIR",
        "Folder of the plan. It holds prbs.csv, sinusoid.csv, protocol.csv, bode.svg and "
        "design.json.",
    ),
    json_out: Path | None = JSON,
    detect: list[str] | None = DETECT.option(
        "--detect NAME=AMOUNT",
        "Difference to detect, such as damping=20%. In inertia, damping or stiffness, as a share "
        "or in N·m·s/rad and the like, as stiffness=0.3; repeat as needed.",
    ),
    from_study: Path | None = DETECT.option(
        "--from STUDY",
        "Study whose SDs between days and epochs are used. A folder with a study.toml and two "
        "conditions; without it the SDs are assumed.",
    ),
    primary: str | None = DETECT.option(
        "--primary NAMES",
        "Primary measures of the study. Default: those that STUDY of --from declares, else "
        "stiffness,damping; also impulse, work, rating.",
    ),
    rule: str | None = DETECT.further(
        "--rule holm|sequence",
        "How the primary measures are tested. Holm; or in sequence, where each is shown only if "
        "those before it are.",
    ),
    declare: Path | None = DETECT.option(
        "--declare STUDY",
        "Declare them in the study.toml of a study. With the date of today; the study is made if "
        "there is none. Not changed once sessions are recorded.",
    ),
    power: float = DETECT.further("--power P", "Chance to show the difference.", 0.8),
    alpha: float = DETECT.further(
        "--alpha P", "Significance level. Of all primary measures together.", 0.05
    ),
    optimise: bool = PERTURB.flag(
        "--optimise",
        "Search for the most precise PRBS. Its clock, bits and amplitude, within the guard's "
        "limits.",
    ),
    criterion: str = PERTURB.further(
        "--criterion NAME",
        "What --optimise minimises: minimax, A or D. Minimax is the largest relative error, A "
        "their root mean square, D the volume of the confidence region.",
        "minimax",
    ),
    multisine: bool = PERTURB.flag(
        "--multisine", "Compare the PRBS with a multisine. With --out also write multisine.csv."
    ),
    body_mass_kg: float | None = PERTURB.further(
        "--body-mass KG",
        "Body mass for the bandwidth of the paper's arm. There it is 7.7 kg (App. A).",
    ),
    forearm_m: float | None = PERTURB.further(
        "--forearm M", "Length of the forearm for that bandwidth. There it is 0.15 m (App. A)."
    ),
    full: bool = WRITE.flag("--full", "Show all of it."),
) -> None:
    """Plan an experiment: stability, precision, days needed.

    Shows the perturbations and their band, the session, the stability of the loop, and the standard
    errors to expect, before anything moves. The exit status is 1 if the loop is unstable, or nearly
    so, with the joint of a condition.

    \b
    For example:
      rigidimeter design
      rigidimeter design --settings examples/settings/study.toml --out planned
      rigidimeter design --primary stiffness --from demo-study
    """
    from rigidimeter.cli.design_text import design_blocks
    from rigidimeter.core.files import write_json
    from rigidimeter.model import refuse_unstable
    from rigidimeter.planning import Forearm, check_criterion, design_document
    from rigidimeter.planning import design as compute

    keep_inputs((json_out,), [path for path in (settings, from_study) if path is not None])
    check_criterion(criterion)
    size = {"body_mass_kg": body_mass_kg, "length_m": forearm_m}
    given = {name: value for name, value in size.items() if value is not None}
    family = _primary(primary, rule, from_study, detect or ())
    scatter = None if from_study is None else _scatter_of(from_study)
    if from_study is not None and not given:
        given = _forearm_of(from_study)
    with Meter("design", 1.0, from_first=True) as meter:
        designed = compute(
            settings,
            differences=detect or (),
            primary=family,
            power=power,
            alpha=alpha,
            scatter=scatter,
            search=criterion if optimise else None,
            with_multisine=multisine,
            forearm=Forearm(**given) if given else None,
            progress=meter.advance,
        )
    show(design_blocks(designed, full=full))
    if out is not None:
        from rigidimeter.analysis.figures import write_design_folder

        echo(f"\nWritten to {out}: {', '.join(write_design_folder(out, designed))}")
    if declare is not None:
        from rigidimeter.core.study_files import declare_primary

        echo(f"{declare_primary(declare, family)}.")
    if json_out is not None:
        write_json(json_out, design_document(designed))
    refuse_unstable(designed.settings, designed.stability)


def _forearm_of(folder: Path) -> dict[str, float]:
    """Return mass and length of the only subject of a study for which both are given, else none."""
    from rigidimeter.core.study_files import STUDY_FILE, read_study_toml

    sizes = [
        {"body_mass_kg": one.body_mass_kg, "length_m": one.forearm_length_m}
        for one in read_study_toml(folder / STUDY_FILE).subjects.values()
        if one.body_mass_kg is not None and one.forearm_length_m is not None
    ]
    return sizes[0] if len(sizes) == 1 else {}


def _primary(
    names: str | None, rule: str | None, study: Path | None, differences: Sequence[str]
) -> PrimaryTable:
    """Return the primary measures: those that are named, those of a study, or the usual ones.

    The smallest difference that is to be detected is the smallest worth finding.
    """
    from rigidimeter.core.study_files import PrimaryTable, declared_primary, primary_named
    from rigidimeter.planning import WantedDifference

    declared = None if study is None else declared_primary(study)
    if names is None and rule is None and declared is not None:
        return declared
    wanted = [WantedDifference.parse(text) for text in differences]
    percents = [abs(one.amount) for one in wanted if one.percent and one.parameter != "inertia"]
    smallest = {"difference_percent": min(max(min(percents), 1.0), 100.0)} if percents else {}
    usual = declared or PrimaryTable()
    measures = ",".join(usual.measures) if names is None else names
    return primary_named(measures, rule or usual.rule, **smallest)


def _scatter_of(folder: Path) -> dict[str, Scatter]:
    """Estimate every epoch of a study, and return how much inertia, damping and stiffness vary."""
    from rigidimeter.analysis.study import day_scatter
    from rigidimeter.cli.study_inputs import estimate_study_inputs, read_study_inputs
    from rigidimeter.core.study_files import STUDY_FILE, is_study
    from rigidimeter.planning import CORRELATION, Scatter

    if not is_study(folder):
        raise UserError(f"--from {folder}: is no study folder: it has no {STUDY_FILE}")
    read = read_study_inputs(folder, plain_recordings(folder))
    analysis, notices = estimate_study_inputs(read)
    say(notices)
    found = {}
    for one in day_scatter(read, analysis):
        source, of_one = f"{folder}, {one.epochs} epochs", one.condition_in_day_percent
        if math.isnan(of_one):
            of_one = one.between_days_percent * math.sqrt(1.0 - CORRELATION)
            source += ", no two days with both conditions: half of the variance of days in one"
        else:
            source += f", {one.days_both} days with both conditions"
        found[one.name.partition("_")[0]] = Scatter(
            one.between_epochs_percent, one.between_days_percent, of_one, source
        )
    return found
