"""`rigidimeter design`: what will be commanded, before any hardware."""

from __future__ import annotations

import csv
import json
import math
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rigidimeter.cli.inputs import keep_inputs
from rigidimeter.errors import UserError
from rigidimeter.units import deg_from_rad, rad_from_deg

if TYPE_CHECKING:
    from rigidimeter.design import Corner, Overview

__all__ = ["SCHEMA", "design"]

SCHEMA = "rigidimeter.design/1"


def design(
    settings: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Settings in TOML; what is left out has its default."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for prbs.csv, sinusoid.csv, protocol.csv and design.json.",
        ),
    ] = None,
    json_out: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="File for the numbers, as JSON."),
    ] = None,
) -> None:
    """Show what will be commanded: perturbations, their band, the session, the controller.

    Nothing moves. Where the PRBS misses the wanted band, or a perturbation asks for more than the
    guard allows, a sentence says so.

    \b
    For example:
      rigidimeter design
      rigidimeter design --settings rig.toml
      rigidimeter design --settings rig.toml --out planned --json numbers.json
    """
    from rigidimeter.design import overview
    from rigidimeter.settings import load_settings

    keep_inputs((json_out,), [settings] if settings is not None else [])
    planned = overview(load_settings(settings))
    typer.echo("\n".join(_lines(planned)))
    document = _document(planned)
    if out is not None:
        _write_folder(out, planned, document)
        typer.echo(f"\nWritten to {out}: prbs.csv, sinusoid.csv, protocol.csv, design.json")
    if json_out is not None:
        _write_json(json_out, document)


def _document(planned: Overview) -> dict[str, Any]:
    """Return all numbers as plain values, units in the names."""
    from rigidimeter.design import period_s, time_constant_s

    settings, band, table = planned.settings, planned.band, planned.bandwidth
    controller = settings.controller
    tau_s = time_constant_s(controller)
    return {
        "schema": SCHEMA,
        "prbs": {
            **settings.prbs.model_dump(),
            "tick_rate_hz": settings.rig.tick_rate_hz,
            "period_s": period_s(settings.prbs),
            "level_low_nm": float(planned.perturbation_nm.min()),
            "level_high_nm": float(planned.perturbation_nm.max()),
            **{name: value for name, value in vars(band).items() if not name.startswith("enough")},
            "enough": {
                "register_bits": band.enough.register_bits,
                "clock_hz": band.enough.clock_hz,
                "duration_s": band.enough.duration_s,
                "tick_rate_hz": band.enough_rate_hz,
            },
            "response": {name: vars(needs) for name, needs in planned.prbs_demand.items()},
        },
        "bandwidth": {
            "uncertainty_percent": table.uncertainty_percent,
            "nominal": _corner(table.nominal),
            "corners": [_corner(corner) for corner in table.corners],
            "equation_8": _corner(table.equation_8),
            "widest": _corner(table.widest),
        },
        "sinusoid": {
            **settings.sinusoid.model_dump(),
            "response": vars(planned.sinusoid_demand),
        },
        "protocol": {
            "seed": planned.protocol.seed,
            "total_s": planned.protocol.total_s,
            "counts": [
                {"task": task, "condition": condition, "epochs": epochs}
                for (task, condition), epochs in planned.protocol.counts.items()
            ],
            "epochs": [vars(epoch) for epoch in planned.protocol.epochs],
        },
        "controller": {
            **controller.model_dump(),
            "inertia_kg_m2_per_deg": rad_from_deg(controller.inertia_kg_m2),
            "damping_nm_s_deg": rad_from_deg(controller.damping_nm_s_rad),
            "time_constant_s": tau_s if math.isfinite(tau_s) else None,
        },
        "guard": settings.guard.model_dump(),
        "warnings": list(planned.warnings),
    }


def _corner(corner: Corner) -> dict[str, Any]:
    return {
        "signs": list(corner.signs),
        **vars(corner.joint),
        "bandwidth_hz": corner.bandwidth_hz,
    }


def _lines(planned: Overview) -> Iterator[str]:
    """Yield the text that the command prints."""
    for section in (_prbs, _sinusoid, _controller, _bandwidth, _protocol):
        yield from section(planned)
        yield ""
    if not planned.warnings:
        yield "All of it stays within the guard's limits."
    for warning in planned.warnings:
        yield from _wrapped(f"Warning: {warning}.", indent="")


def _wrapped(text: str, indent: str = "  ") -> list[str]:
    return textwrap.wrap(text, 96, initial_indent=indent, subsequent_indent="  ")


def _prbs(planned: Overview) -> Iterator[str]:
    from rigidimeter.design import chip_count, period_s

    prbs, band = planned.settings.prbs, planned.band
    low_nm, high_nm = planned.perturbation_nm.min(), planned.perturbation_nm.max()
    yield "Torque perturbation (PRBS)"
    yield (
        f"  {prbs.register_bits} bits ({chip_count(prbs)} chips) at {prbs.clock_hz:g} Hz, period "
        f"{period_s(prbs):.4g} s; {prbs.duration_s:g} s at {planned.settings.rig.tick_rate_hz:g} "
        "ticks/s"
    )
    yield f"  ±{prbs.amplitude_nm:g} N·m; without its mean {low_nm:+.4g} and {high_nm:+.4g} N·m"
    yield (
        f"  lines every {band.line_spacing_hz:.4g} Hz; plateau {band.plateau_n2m2_hz:.4g} N²m²/Hz; "
        f"−3 dB at {band.half_power_hz:.2f} Hz"
    )
    yield (
        f"  in the wanted band: {band.lines_in_band} lines, {band.in_band_percent:.0f} % of the "
        "power"
    )
    yield from _wrapped(band.verdict)
    yield "  predicted in the ideal loop   angle SD    peak angle    peak speed"
    for name, needs in planned.prbs_demand.items():
        yield (
            f"    {name:<22} {deg_from_rad(needs.angle_sd_rad):9.2f} deg"
            f" {deg_from_rad(needs.peak_angle_rad):9.2f} deg"
            f" {deg_from_rad(needs.peak_speed_rad_s):7.1f} deg/s"
        )


def _sinusoid(planned: Overview) -> Iterator[str]:
    sinusoid, guard = planned.settings.sinusoid, planned.settings.guard
    needs = planned.sinusoid_demand
    yield "Position perturbation (sinusoid)"
    yield (
        f"  ±{sinusoid.amplitude_deg:g} deg at {sinusoid.frequency_hz:g} Hz for "
        f"{sinusoid.motion_s:g} s of {sinusoid.duration_s:g} s, tapers of {sinusoid.taper_s:g} s"
    )
    for name, value, limit, unit in (
        ("peak speed", needs.peak_speed_rad_s, guard.speed_limit_deg_s, "deg/s"),
        (
            "peak acceleration",
            needs.peak_acceleration_rad_s2,
            guard.acceleration_limit_deg_s2,
            "deg/s²",
        ),
        ("angle with the room to stop", needs.reach_rad, guard.position_limit_deg, "deg"),
    ):
        yield f"  {name} {deg_from_rad(value):.4g} {unit} (guard: {limit:g} {unit})"


def _controller(planned: Overview) -> Iterator[str]:
    from rigidimeter.design import time_constant_s

    controller = planned.settings.controller
    J, B = controller.inertia_kg_m2, controller.damping_nm_s_rad
    tau_s = time_constant_s(controller)
    yield "Controller (admittance)"
    yield f"  J_c {J:.4g} kg·m²/rad ({rad_from_deg(J):.4g} kg·m²/deg)"
    yield f"  B_c {B:.4g} N·m·s/rad ({rad_from_deg(B):.4g} N·m·s/deg)"
    if math.isfinite(tau_s):
        yield f"  time constant of the free arm J_c/B_c {tau_s:.4g} s"
    else:
        yield "  no damping: the free arm's velocity never settles"


def _bandwidth(planned: Overview) -> Iterator[str]:
    table = planned.bandwidth
    yield f"Bandwidth (−3 dB) of the arm of App. A, J, B, K ±{table.uncertainty_percent:g} %"
    yield "  corner     J kg·m²  B N·m·s/rad  K N·m/rad      Hz"
    for corner in (table.nominal, *table.corners):
        name = "nominal" if not any(corner.signs) else "".join("−0+"[s + 1] for s in corner.signs)
        notes = {table.equation_8.signs: "  Eq. 8", table.widest.signs: "  widest"}
        yield (
            f"  {name:<9} {corner.joint.inertia_kg_m2:8.4f} {corner.joint.damping_nm_s_rad:12.3f}"
            f" {corner.joint.stiffness_nm_rad:10.2f} {corner.bandwidth_hz:7.2f}"
            f"{notes.get(corner.signs, '')}"
        )


def _protocol(planned: Overview) -> Iterator[str]:
    protocol = planned.protocol
    yield f"Protocol (seed {protocol.seed})"
    for (task, condition), epochs in protocol.counts.items():
        yield f"  {condition}, {task}: {epochs} {'epoch' if epochs == 1 else 'epochs'}"
    yield f"  {protocol.total_s:g} s ({protocol.total_s / 60:.1f} min) with the rests"


def _write_folder(folder: Path, planned: Overview, document: dict[str, Any]) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{folder}: cannot be made a folder ({error.strerror or error})") from None
    rate_hz = planned.settings.rig.tick_rate_hz
    torque = planned.perturbation_nm.tolist()
    motion = zip(planned.angle_rad.tolist(), planned.velocity_rad_s.tolist(), strict=True)
    epochs = document["protocol"]["epochs"]
    _write_csv(
        folder / "prbs.csv",
        ("time_s", "perturbation_nm"),
        ((tick / rate_hz, value) for tick, value in enumerate(torque)),
    )
    _write_csv(
        folder / "sinusoid.csv",
        ("time_s", "angle_rad", "velocity_rad_s"),
        ((tick / rate_hz, *values) for tick, values in enumerate(motion)),
    )
    _write_csv(folder / "protocol.csv", list(epochs[0]), (epoch.values() for epoch in epochs))
    _write_json(folder / "design.json", document)


def _write_csv(path: Path, header: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    try:
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header)
            writer.writerows(rows)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror or error})") from None


def _write_json(path: Path, document: dict[str, Any]) -> None:
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror or error})") from None
