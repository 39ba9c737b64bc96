"""The tables of the reference of files: names from the code, meanings from the data dictionary."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from rigidimeter.analysis.batch import columns as batch_columns
from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.reading.channels.choice import LABELS
from rigidimeter.analysis.reading.formats import READERS
from rigidimeter.core.files import Meaning, described, meaning_of
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import (
    CHANNEL_UNITS,
    EMG_CHANNELS,
    Activity,
    Analysis,
    Delay,
    Fit,
    Outcome,
    Score,
)
from rigidimeter.core.session import SAMPLE_UNITS


def analysis() -> Analysis:
    """Return an analysis of two conditions that has one of everything."""

    def fits(*conditions: str) -> tuple[Fit, ...]:
        return tuple(
            Fit(
                "s",
                str(k),
                name,
                "bandlimited",
                Outcome(),
                value=(1.0 + k, 2.0 + k, 3.0 + k),
                findings=(Finding("frozen", "caution", 1.0, 2.0),),
            )
            for k, name in enumerate(conditions)
        )

    found = fits(*["OFF"] * 3, *["DBS"] * 3)
    score = Score("s", "9", "OFF", Outcome(), 1.0, 2.0, 8, 1.0)
    return Analysis("bandlimited", found, found, 1.0, (score,), found[:2], (Delay("s", 0.0, 0.1),))


def _keys(section: str, first: str = "key") -> Callable[[], str]:
    """Return what makes the table of everything that a section describes."""
    return lambda: _table(first, described(section))


def _columns(table: str, names: Iterable[str], **said: Meaning) -> str:
    return _table("key", {name: said.get(name) or meaning_of(table, name) for name in names})


def _table(first: str, rows: Mapping[str, Meaning | str]) -> str:
    lines = [f"| {first} | what it holds |", "| --- | --- |"]
    for name, said in rows.items():
        shown = name if "`" in name else f"`{name}`"
        text = said if isinstance(said, str) else _in_words(said)
        lines.append(f"| {shown} | {text} |")
    return "\n".join(lines)


def _in_words(said: Meaning) -> str:
    unit = said.unit.replace("(column ", "in `").replace(")", "`") if said.unit != "1" else ""
    return ", ".join(part for part in (unit, said.meaning) if part)


def _fit() -> str:
    listed = {"band_hz": Meaning("Hz", "[low, high]"), "findings": Meaning("", "a list, below")}
    names = [*estimates_document(analysis())["epochs"][0], *Activity((), 0.0, 0.0).row()]
    return _columns("estimates", names, **listed)


def _score() -> str:
    return _columns("scores", estimates_document(analysis())["scores"][0])


def _delay() -> str:
    return _columns("delays", estimates_document(analysis())["delays"][0])


def _finding() -> str:
    return _columns("finding", estimates_document(analysis())["epochs"][0]["findings"][0])


def _batch() -> str:
    names = [*batch_columns()]
    return _columns("batch", names[:10] + names[-4:])


def formats_table() -> str:
    """Return every format that is read, what its files state, and what it needs."""
    lines = ["| format | files | units, clock and epochs | needs |", "| --- | --- | --- | --- |"]
    for reader in READERS:
        suffixes = ", ".join(f"`{suffix}`" for suffix in reader.suffixes) or "a folder"
        extra = f"`[{reader.extra}]`" if reader.extra else "–"
        lines.append(f"| {reader.name} | {suffixes} | {reader.about} | {extra} |")
    return "\n".join(lines)


def columns_read() -> str:
    """Return the columns that a recording may have."""
    read = described("read")
    rows = {"time_s": "s"} | {n: u for n, u in CHANNEL_UNITS.items() if n not in EMG_CHANNELS[1:]}
    lines = ["| column | unit | |", "| --- | --- | --- |"]
    lines += [
        f"| `{name}` | {rows.get(name, '')} | {read[name].meaning} |" for name in (*rows, *LABELS)
    ]
    return "\n".join(lines)


ratings_keys = _keys("ratings.json")

FILES_BLOCKS: Mapping[str, Callable[[], str]] = {
    "manifest": _keys("manifest.json"),
    "samples": lambda: _table("column", SAMPLE_UNITS),
    "events": _keys("events", "event"),
    "rig events": _keys("rig events", "event of a rig"),
    "estimates": _keys("estimates.json"),
    "fit": _fit,
    "finding": _finding,
    "sensitivity": _keys("sensitivity.json"),
    "delay": _delay,
    "score": _score,
    "batch": _batch,
    "comparison": _keys("comparison.json"),
    "conclusion": _keys("conclusion"),
    "each comparison": _keys("comparisons"),
    "days": _keys("test by days"),
    "tables": lambda: _table(
        "table", {k: f"one row for {v.meaning}" for k, v in described("rows").items()}
    ),
    "export": _keys("session.json"),
}
"""The blocks of the reference of files."""
