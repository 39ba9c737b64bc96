"""The kept analysis of a study, and what is new since: inputs by their digests, numbers by name.

    STUDY/analysis/inputs.json      digests of all inputs and results, settings, method, seed
    STUDY/analysis/estimates.json   the estimates, as `rigidimeter estimate` writes them
    STUDY/analysis/comparison.json  every conclusion
    STUDY/analysis/*.csv            the same as tables, and data-dictionary.csv: what is in them

A file whose bytes would be the same is not written again. `comparison.json` and then `inputs.json`
are written last: a run that was cut off leaves those of the run before, and the next one says what
is new since then.
"""

from __future__ import annotations

import hashlib
import itertools
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.study.document import (
    columns_of_rows,
    comparison_document,
    result_table,
    table_csv,
)
from rigidimeter.analysis.study.from_folder import ANALYSIS, COMPARISON, Loaded
from rigidimeter.analysis.study.measures import RATING
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.analysis.study.reuse import (
    ESTIMATES,
    ROWS,
    file_digest,
    rows_file,
    stored_study,
)
from rigidimeter.analysis.study.study import Study
from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import (
    DICTIONARY,
    dictionary_text,
    json_text,
    read_json,
    replace_file,
    text_bytes,
)
from rigidimeter.core.settings import Settings, dump_settings, with_new_names
from rigidimeter.core.version import __version__

INPUTS_SCHEMA = "rigidimeter.study-inputs/1"
UNCHANGED = "nothing has changed since the last analysis"
INPUTS = "inputs.json"

_SHOWN = 12
_PAIR = ("reference", "other")
_TABLES = ("conclusion", "precision", "comparisons", "days", "effect_differences", "ratings",
           "sensitivity", "excluded_epochs", "left_out", "estimates", "scores")  # fmt: skip
_COMPARED = ("shift", "p", "r")
_SIZES = ("r_low", "r_high", "rank_biserial", "rank_biserial_low", "rank_biserial_high")
_BY_DAYS = ("estimate", "p", "p_days", "day_share")


def keep(loaded: Loaded, result: StudyResult) -> list[str]:
    """Write what is new into ``STUDY/analysis``; return in sentences what that is.

    A result that was edited by hand is kept beside the new one as ``NAME.edited``. Nothing is said
    of a first analysis.

    Parameters
    ----------
    loaded : Loaded
        The study folder as it was read.
    result : StudyResult
        What was concluded from it.

    Returns
    -------
    list of str
        What is new since the last analysis; `UNCHANGED` alone where nothing is.

    Raises
    ------
    UserError
        If a file cannot be written.
    """
    folder = loaded.folder.folder / ANALYSIS
    document = comparison_document(result, str(loaded.folder.folder))
    made = {f"{name}.csv": result_table(result, name) for name in _TABLES}
    tables = {name: rows for name, rows in made.items() if rows}
    texts = {
        ESTIMATES: json_text(estimates_document(result.study.analysis)),
        **{name: table_csv(rows) for name, rows in tables.items()},
        DICTIONARY: dictionary_text({name: columns_of_rows(rows) for name, rows in tables.items()}),
        COMPARISON: json_text(document),
    }
    with refused(loaded.folder.folder, "cannot be read"):
        stored = rows_file(loaded, result.study)
    contents = {} if stored is None else {ROWS: stored}
    contents |= {name: text_bytes(text) for name, text in texts.items()}
    inputs = _inputs(loaded, result)
    results = {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}
    before = _inputs_before(folder)
    said: list[str] = []
    edited = _edited(folder, before, results, said)
    known = ("", *loaded.names.known)
    if before and loaded.names.blinded and not all(before.get(n) in known for n in _PAIR):
        said.append("condition names differ from last time; listing changes could reveal the codes")
    elif before is not None:
        said += _new_inputs(before, inputs)
        old = _object(folder / COMPARISON) if COMPARISON not in edited else None
        if old is not None:
            said += _moved(old, document)
    elif (folder / INPUTS).exists():
        said.append(f"{ANALYSIS}/{INPUTS} is damaged, so what has changed since is unknown")
    _write(folder, contents, edited)
    with refused(folder, "cannot be written"):
        for name in sorted({*_results(before)} - {*contents} - {*edited}):
            (folder / name).unlink(missing_ok=True)  # ours, unedited, and no longer a result
    _write_new(folder / INPUTS, text_bytes(json_text({**inputs, "results": results})))
    if before is not None and not said:
        said.append(UNCHANGED)
    return said


def kept_study(
    folder: Path,
    *,
    adjust: Callable[[Settings], Settings] = lambda settings: settings,
    **asked: Any,
) -> tuple[Loaded, Study] | None:
    """Return a study as it was analysed before, if nothing that it was made of has changed.

    Parameters
    ----------
    folder : Path
    adjust : callable
        Changes the settings of the folder before it is analysed.
    asked
        `key`, `settings`, `method` and `pair`, as `load_study`.

    Returns
    -------
    (Loaded, Study) or None
        What is loaded has no recordings; `keep` takes it.
    """
    results = _results(_inputs_before(folder / ANALYSIS))
    return stored_study(folder, **asked, adjust=adjust, results=results)


def _inputs(loaded: Loaded, result: StudyResult) -> dict[str, Any]:
    return {
        "schema": INPUTS_SCHEMA,
        "software": f"rigidimeter {__version__}",
        "method": result.study.analysis.method,
        "reference": loaded.names.pair[0],
        "other": loaded.names.pair[1],
        "seed": result.seed,
        "resamples": result.resamples,
        "settings": dump_settings(result.study.settings),
        "files": dict(result.study.digests),
    }


def _edited(
    folder: Path, before: Mapping[str, Any] | None, results: Mapping[str, str], said: list[str]
) -> dict[str, str]:
    """Return the results that are not as they were written, and under what name to keep each.

    One that is as it will be written now is none of them: a run that was cut off left it.
    """
    edited = {}
    with refused(folder, "cannot be read"):
        for name, digest in (_results(before) or dict.fromkeys(results, "")).items():
            path = folder / name
            if not path.is_file():
                if digest and name in results:
                    said.append(f"{ANALYSIS}/{name} was taken away; it is written again")
            elif file_digest(path) not in (digest, results.get(name)):
                edited[name] = _free(folder, f"{name}.edited")
                how = "was changed by hand after it was written" if digest else "was there already"
                said.append(
                    f"{ANALYSIS}/{name} {how}; it is written again; the previous one is "
                    f"stored as {edited[name]}"
                )
    return edited


def _free(folder: Path, name: str) -> str:
    """Return the name, or the first of ``name-2``, ``name-3`` and so on that is not taken."""
    names = itertools.chain([name], (f"{name}-{number}" for number in itertools.count(2)))
    return next(each for each in names if not (folder / each).exists())


def _new_inputs(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    for name in ("software", "method", *_PAIR, "seed", "resamples"):
        if before.get(name) != now[name]:
            yield f"{name}: {before.get(name)} → {now[name]}"
    old, new = dict(_leaves(with_new_names(before["settings"]))), dict(_leaves(now["settings"]))
    for name in dict.fromkeys([*old, *new]):
        if old.get(name) != new.get(name):
            yield f"setting {name}: {old.get(name)} → {new.get(name)}"
    old, new = before["files"], now["files"]
    for what, names in (
        ("new", [name for name in new if name not in old]),
        ("gone", [name for name in old if name not in new]),
        ("changed", [name for name in new if name in old and old[name] != new[name]]),
    ):
        if names:
            more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
            yield f"inputs that are {what}: {', '.join(names[:_SHOWN])}{more}"


def _moved(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """Say which numbers moved, one sentence for each measure and test."""
    before, now = (dict(_numbers(document)) for document in (old, new))
    for title in dict.fromkeys([*before, *now]):
        if title not in now:
            yield f"{title} is no longer there"
        elif title not in before:
            yield f"{title} is new"
        else:
            one, two = before[title], now[title]
            moved = [
                f"{name} {_from_to(one.get(name), two.get(name))}"
                for name in dict.fromkeys([*one, *two])
                if one.get(name) != two.get(name)
            ]
            if moved:
                yield f"{title}: {', '.join(moved)}"


def _numbers(document: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield what a reader would look at, by the name of the test."""
    try:
        for c in document["comparisons"]:
            name = c["measure"]
            if c.get("other", document["other"]) != document["other"]:  # of a further condition
                name += f", {c['reference']} − {c['other']}"
            if c["measure"] != RATING.name:  # an older document tests the corrected scores apart
                row = {f"n {one}": group["n"] for one, group in c["groups"].items()}
                row |= {f"median {one}": group["median"] for one, group in c["groups"].items()}
                yield name, row | {key: c.get(key) for key in _COMPARED}
                if c["days"] is not None:
                    yield f"{name} by days", {key: c["days"][key] for key in _BY_DAYS}
            if c.get("rank_biserial") is not None:
                sizes = {key: c[key] for key in _SIZES}
                yield f"{name}, effect size", sizes | {"p by Holm": c["p_holm"]}
        for d in document["effect_differences"]:
            row = {name: d[name] for name in ("estimate", "low", "high", "p")}
            yield f"{d['first']} − {d['second']}, difference of effect sizes", row
        if document["ratings"] is not None:
            contrast = document["ratings"]["contrast"]
            row = {"n": document["ratings"]["n"], "estimate": contrast["estimate"]}
            yield "ratings, contrast", row | {"p": contrast["p_residual"]}
        for s in document["sensitivity"]:
            title = f"{s['measure']}, {s['method']}, J {s['inertia']}"
            yield title, {name: s[name] for name in ("shift", "p", "p_day")}
        yield "epochs left out", {"count": len(document["exclusions"])}
    except (KeyError, TypeError, AttributeError):
        return  # of another version


def _from_to(old: Any, new: Any) -> str:
    shown = [_number(value, 4) for value in (old, new)]
    if shown[0] == shown[1]:
        shown = [_number(value, 17) for value in (old, new)]
    return " → ".join(shown)


def _number(value: Any, digits: int) -> str:
    if value is None:
        return "none"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def _leaves(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _write(folder: Path, contents: Mapping[str, bytes], edited: Mapping[str, str]) -> None:
    with refused(folder, "cannot be written"):
        folder.mkdir(exist_ok=True)
        for name, aside in edited.items():
            (folder / name).replace(folder / aside)
    for name, content in contents.items():
        _write_new(folder / name, content)


def _write_new(path: Path, content: bytes) -> None:
    """Write a file unless it holds these bytes already."""
    with suppress(OSError):  # writing says what is wrong
        if path.is_file() and path.read_bytes() == content:
            return
    with refused(path, "cannot be written"):
        replace_file(path, content)


def _results(before: Mapping[str, Any] | None) -> dict[str, str]:
    results = (before or {}).get("results")
    if not isinstance(results, dict):
        return {}
    # A name is a file of the folder, nothing else: this one may have been edited too.
    return {
        name: str(digest)
        for name, digest in results.items()
        if Path(name).name == name and name not in ("", os.curdir, os.pardir)
    }


def _inputs_before(folder: Path) -> dict[str, Any] | None:
    """Return what `_inputs` was last time; None where there is nothing of its form."""
    found = _object(folder / INPUTS) or {}
    tables = (found.get(name) for name in ("settings", "files"))
    valid = found.get("schema") == INPUTS_SCHEMA and all(isinstance(t, dict) for t in tables)
    return found if valid else None


def _object(path: Path) -> dict[str, Any] | None:
    try:
        found = read_json(path)
    except UserError:
        return None
    return found if isinstance(found, dict) else None
