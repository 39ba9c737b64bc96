"""The tables of an NWB file: trials, stimulation, events, estimates, scores and ratings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rigidimeter.analysis.export.document_tables import (
    columns_of,
    document_tables,
    exclusion_reasons,
)

if TYPE_CHECKING:
    from pynwb import NWBFile


def add_trials(file: NWBFile, about: Mapping[str, Any]) -> None:
    """Add a row for each epoch, and for each rest between two."""
    for name, text in {
        "task": "prbs (torque perturbation) or sinusoid (imposed motion).",
        "condition": "Condition, or its code where blinded.",
        "epoch": "Label of the epoch.",
        "excluded": "Whether the epoch does not count.",
        "exclusion_reason": "Why, empty if it counts.",
        "rest": "Whether this is a rest between epochs.",
    }.items():
        file.add_trial_column(name, text)
    rest = {"task": "", "condition": "", "epoch": "", "excluded": False, "exclusion_reason": ""}
    reasons = exclusion_reasons(about)
    before_s: float | None = None
    for epoch in sorted(about["epochs"], key=lambda each: each["start_s"]):
        start_s, stop_s = epoch["start_s"], epoch["stop_s"]
        if before_s is not None and start_s > before_s:
            file.add_trial(start_time=before_s, stop_time=start_s, rest=True, **rest)
        reason = reasons.get(epoch["label"], "")
        file.add_trial(
            start_time=start_s,
            stop_time=stop_s,
            task=epoch["task"] or "",
            condition=epoch["condition"],
            epoch=epoch["label"],
            excluded=bool(reason),
            exclusion_reason=reason,
            rest=False,
        )
        before_s = stop_s


def add_stimulation(file: NWBFile, about: Mapping[str, Any]) -> None:
    """Add the stimulation of the session's condition, where it is known."""
    from pynwb.epoch import TimeIntervals

    known = about.get("stimulation", {}).get(about["condition"], {})
    columns = {
        "frequency_hz": (known.get("frequency_hz"), "Frequency of the stimulation, Hz."),
        "amplitude_ua": (
            None if known.get("amplitude_ma") is None else 1000.0 * known["amplitude_ma"],
            "Amplitude of the stimulation, µA.",
        ),
        "amplitude_v": (known.get("amplitude_v"), "Amplitude of the stimulation, V."),
        "pulse_width_us": (known.get("pulse_width_us"), "Width of a pulse, µs."),
        "electrodes": (known.get("electrodes"), "Electrodes."),
        "washin_s": (
            None if known.get("wash_in_min") is None else 60.0 * known["wash_in_min"],
            "Time between the change of the stimulation and the session, s.",
        ),
    }
    given = {name: pair for name, pair in columns.items() if pair[0] not in (None, "")}
    if not given or not about["epochs"]:
        return
    table = TimeIntervals(name="dbs_settings", description="Deep brain stimulation in the session.")
    for name, (_, text) in given.items():
        table.add_column(name, text)
    table.add_row(
        start_time=min(epoch["start_s"] for epoch in about["epochs"]),
        stop_time=max(epoch["stop_s"] for epoch in about["epochs"]),
        **{name: value for name, (value, _) in given.items()},
    )
    file.add_time_intervals(table)


def add_events(file: NWBFile, about: Mapping[str, Any]) -> None:
    """Add what happened at a time that is known."""
    from pynwb.event import EventsTable

    events = [
        event
        for event in about["recorded"].get("events", ())
        if isinstance(event.get("time_s"), int | float)
    ]
    if not events:
        return
    table = EventsTable(name="session_events", description="Events of the session, as recorded.")
    for name in ("event", "epoch", "outcome", "reason"):
        table.add_column(name, f"{name.capitalize()}; empty where it has none.")
    for event in sorted(events, key=lambda each: each["time_s"]):
        table.add_row(
            timestamp=float(event["time_s"]),
            event=str(event["event"]),
            epoch=str(event.get("epoch", "")),
            outcome=str(event.get("outcome", "")),
            reason=str(event.get("reason", "")),
        )
    file.add_events_table(table)


def add_tables(file: NWBFile, about: Mapping[str, Any]) -> None:
    """Add estimates, scores and ratings, where there are any."""
    texts = {
        "estimates": "Inertia, damping and stiffness of each epoch, with standard errors and 95 % "
        "intervals; fixed_inertia: fitted again with the median inertia held. Units in the names.",
        "scores": "Impulse and work of each imposed sinusoid, per cycle. Units in the names.",
        "ratings": "Scores of examiners on this day.",
    }
    tables = {name: rows for name, rows in document_tables(about).items() if name in texts}
    if not tables:
        return
    module = file.create_processing_module("rigidimeter", f"Results of {about['software']}.")
    for name, rows in tables.items():
        module.add(_table(name, texts[name], rows))


def _table(name: str, description: str, rows: Iterable[Mapping[str, Any]]) -> Any:
    from hdmf.common import DynamicTable, VectorData

    columns: list[Any] = []
    for column, cells in columns_of(rows).items():
        if not _says_something(cells):
            continue
        text = column.replace("_", " ")
        columns.append(VectorData(name=column, description=text, data=cells))
    return DynamicTable(name=name, description=description, columns=columns)


def _says_something(cells: Sequence[Any]) -> bool:
    return any(cell != "" and cell == cell for cell in cells)
