"""Models of the torque as they are shown on a terminal: one screen, or each epoch."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from statistics import median

from rigidimeter.analysis.estimation import Comparison, ModelRow
from rigidimeter.analysis.recording import ModelledEpoch
from rigidimeter.cli.terminal_tables import Block, Heading, Table
from rigidimeter.core.findings import SERIOUS_FIRST
from rigidimeter.core.records import notes_text
from rigidimeter.core.words import plural, with_error

_COMPARED = ("parameters", "VAF %", "held out, 95 %", "AIC", "BIC", "white p", "input p")
MOST_FINDINGS = 3
JOINT = "inertia+damping+stiffness"


def model_blocks(found: Sequence[ModelledEpoch], *, full: bool = False) -> Iterator[Block]:
    """Yield what the models are: of one epoch, or of several epochs together.

    With `full` each epoch with all of its models.
    """
    fitted = [each for each in found if each.models is not None]
    if full or len(found) == 1 or not fitted:
        for place, each in enumerate(found):
            yield from ([""] if place else [])
            yield from _epoch_blocks(each)
        return
    bands = sorted({each.models.band_hz for each in fitted if each.models is not None})
    low, high = bands[0]
    count = plural(len(found), "epoch")
    failed = f", {len(found) - len(fitted)} failed" if len(fitted) < len(found) else ""
    yield Heading(f"{count}{failed}, {low:.4g} to {high:.4g} Hz")
    yield ""
    if fitted[0].compared:
        yield from _models(fitted)
    else:
        for rows in _rows(fitted).values():
            yield from _parameters(rows)
    if notes := list(_findings(fitted)):
        yield ""
        yield Table((), notes, "<<", 1)
    yield from ("", "--full: every epoch · --json FILE: every number")


def _rows(fitted: Sequence[ModelledEpoch]) -> dict[str, list[ModelRow]]:
    """Return the rows of each model, by its terms."""
    found: dict[str, list[ModelRow]] = {}
    for each in fitted:
        for row in each.models.compared.rows if each.models is not None else ():
            found.setdefault("+".join(row.terms), []).append(row)
    return found


def _parameters(rows: Sequence[ModelRow]) -> Iterator[Block]:
    """Yield the parameters of a model in one epoch, or their median and range in several."""
    terms, fits = "+".join(rows[0].terms), [row.fit for row in rows if row.fit is not None]
    if not fits:
        yield f" {terms}: {rows[0].problem}"
        return
    several = len(rows) > 1
    vaf = [fit.vaf_percent for fit in fits]
    yield f" {terms}, VAF {median(vaf):.2f} %" + f", at least {min(vaf):.2f} %" * several
    values: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for fit in fits:
        for one in fit.parameters:
            if not one.name.startswith("response"):
                key = f"{one.term} {one.name}".strip(), one.unit
                values.setdefault(key, []).append((one.value, one.standard_error))
    cells: list[Sequence[str] | str] = []
    for (name, unit), own in values.items():
        middle, error = (median(sizes) for sizes in zip(*own, strict=True))
        ends = [with_error(end(value for value, _ in own), 0.0) for end in (min, max)]
        cells.append((name, unit, with_error(middle, error), " to ".join(ends) * several))
    yield Table(("", "unit", "median of epochs" * several, "range"), cells, "<<>>", 1)
    if not several:
        yield from (f"    {remark}" for remark in fits[0].remarks)
        for gain in rows[0].beyond:
            size = with_error(gain.value, gain.standard_error)
            yield f"    {gain.term} from what no linear loop explains: {size} {gain.unit}"


def _models(fitted: Sequence[ModelledEpoch]) -> Iterator[Block]:
    """Yield in how many epochs each model is recommended, and how well it predicts."""
    chosen: Counter[str] = Counter()
    for each in fitted:
        best = None if each.models is None else each.models.compared.recommended
        chosen["" if best is None else "+".join(best.terms)] += 1
    cells = []
    for terms, rows in _rows(fitted).items():
        fits = [row.fit for row in rows if row.fit is not None]
        held_out = [row.held_out[0] for row in rows if row.held_out is not None]
        cells.append(
            (
                terms.replace(JOINT, "J+B+K"),
                f"{chosen[terms]} of {len(fitted)}",
                f"{median(fit.vaf_percent for fit in fits):.2f}" if fits else "–",
                f"{median(held_out):.2f}" if held_out else "–",
            )
        )
    yield Table(("model", "recommended", "VAF, %", "held out, %"), cells, "=>>>", 1)
    if chosen[""]:
        yield f" no model is recommended in {plural(chosen[''], 'epoch')}"


def _findings(fitted: Sequence[ModelledEpoch]) -> Iterator[tuple[str, str]]:
    """Yield each kind of finding once, with the number of epochs that have it."""
    found = [one for each in fitted if each.models for one in each.models.findings]
    counts = Counter((one.level, one.name) for one in found if not one.harmless)
    ordered = sorted(counts.items(), key=lambda each: (SERIOUS_FIRST.index(each[0][0]), -each[1]))
    for (level, name), count in ordered[:MOST_FINDINGS]:
        first = next(one for one in found if (one.level, one.name) == (level, name))
        yield level, f"{name}  {first.headline}; {count} of {plural(len(fitted), 'epoch')}"
    if quiet := [one.name for one in found if one.harmless]:
        yield "note", f"{notes_text(quiet)} (--full)"


def _epoch_blocks(found: ModelledEpoch) -> Iterator[Block]:
    if found.models is None:
        yield f"{found.epoch.name}: failed, {found.problem}"
        return
    low, high = found.models.band_hz
    compared = found.models.compared
    yield Heading(f"{found.epoch.name}, {low:.4g} to {high:.4g} Hz")
    if found.clock:
        yield f"  {found.clock}"
    shown: Iterable[ModelRow] = compared.rows
    if found.compared:
        yield from _compared_blocks(compared)
        shown = filter(None, (compared.recommended,))
    for row in shown:
        yield from _parameters([row])
    yield from (f"  {one.level}  {one.name}  {one.headline}" for one in found.models.findings)


def _compared_blocks(compared: Comparison) -> Iterator[Block]:
    rows: list[Sequence[str] | str] = []
    for row in compared.rows:
        if row.fit is None:
            rows.append(f"  {row.name}: {row.problem}")
            continue
        fit = row.fit
        rows.append(f"{'*' if row is compared.recommended else ' '} {row.name}")
        rows.append(
            (
                f"{fit.n_parameters}",
                f"{fit.vaf_percent:.2f}",
                "" if row.held_out is None else "{:.2f} [{:.2f}, {:.2f}]".format(*row.held_out),
                f"{fit.aic:.1f}",
                f"{fit.bic:.1f}",
                f"{fit.test.ljung_box_p:.2g}",
                f"{fit.test.input_p:.2g}",
            )
        )
    yield Table(_COMPARED, rows, ">>=>>>>")
    yield from (f"  {row.name}: {row.problem}" for row in compared.rows if row.fit and row.problem)
    verdict = "no model is recommended" if compared.recommended is None else "recommended"
    yield f"  {verdict}: {compared.reason}"
