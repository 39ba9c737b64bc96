"""`rigidimeter emulate`: an emulated rig that uses real communication and can misbehave."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.cli.output import echo
from rigidimeter.core.errors import UserError


def emulate(
    drive: Annotated[
        str, typer.Option("--drive", metavar="cia402|ascii", help="Type of drive.")
    ] = "cia402",
    joint: Annotated[
        tuple[float, float, float],
        typer.Option(
            "--joint",
            metavar="J B K",
            help="J, B, K in kg·m², N·m·s/rad, N·m/rad.",
        ),
    ] = (0.0045, 0.1368, 1.751),
    rig_out: Annotated[
        Path | None,
        typer.Option("--rig-out", metavar="FILE", help="Write a rig file for it."),
    ] = None,
    voluntary: Annotated[
        float,
        typer.Option("--voluntary", metavar="NM", help="SD of the subject's voluntary torque."),
    ] = 0.0,
    torque_rate: Annotated[
        float, typer.Option("--torque-rate-hz", metavar="HZ", help="Torque samples per second.")
    ] = 1000.0,
    noise: Annotated[
        float, typer.Option("--noise-nm", metavar="NM", help="SD of the torque noise.")
    ] = 0.005,
    bandwidth: Annotated[
        float, typer.Option("--bandwidth-hz", metavar="HZ", help="Bandwidth of the drive.")
    ] = 50.0,
    seed: Annotated[int, typer.Option("--seed", help="Seed of all random numbers.")] = 1,
) -> None:
    """Emulate a rig: an arm, a torque sensor and a drive.

    The torque sensor sends UDP, the drive speaks CANopen or ASCII. Prints one line of JSON when
    ready, then reads commands, one per line, and answers each with a line of JSON; the command
    `help` lists them. It ends with the end of its input.

    \b
    For example:
      rigidimeter emulate --rig-out RIG.toml
      rigidimeter emulate --drive ascii --joint 0.0045 0.14 1.75
    """
    from rigidimeter.model import JointDynamics
    from rigidimeter.testing import EmulatedRig, serve

    if drive not in ("cia402", "ascii"):
        raise UserError(f"--drive {drive}: must be cia402 or ascii")
    if rig_out is not None:
        _check_target(rig_out)
    try:
        arm = JointDynamics(*joint)
        rig = EmulatedRig(
            "ascii" if drive == "ascii" else "cia402",
            arm,
            voluntary_sd_nm=voluntary,
            torque_rate_hz=torque_rate,
            noise_sd_nm=noise,
            bandwidth_hz=bandwidth,
            seed=seed,
        )
    except ValueError as error:
        raise UserError(f"the rig cannot be made: {error}") from None
    except ImportError as error:
        raise UserError(
            f"{error.name} is missing: pip install 'rigidimeter[canopen,serial]'"
        ) from None
    with rig:
        try:
            serve(rig, rig_out)
        except KeyboardInterrupt:
            echo("rigidimeter: emulation ended", err=True)


def _check_target(rig_out: Path) -> None:
    """Refuse to overwrite anything but a rig file of an emulated rig."""
    from rigidimeter.rig.devices import load_rig

    if not rig_out.parent.is_dir():
        raise UserError(f"--rig-out {rig_out}: there is no folder {rig_out.parent}; make it first")
    if not rig_out.exists():
        return
    try:
        emulated = load_rig(rig_out).emulated
    except UserError:
        emulated = False
    if not emulated:
        raise UserError(
            f"--rig-out {rig_out}: already exists and is not the rig file of an emulated rig; name "
            "another file, this one is left as it is"
        )


if __name__ == "__main__":
    typer.run(emulate)
