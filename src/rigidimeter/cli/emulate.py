"""`rigidimeter emulate`: an emulated rig that uses real communication and can misbehave."""

from __future__ import annotations

from pathlib import Path

import typer

from rigidimeter.cli.help_pages import OPTIONS
from rigidimeter.cli.output import echo
from rigidimeter.core.errors import UserError


def emulate(
    drive: str = OPTIONS.option("--drive cia402|ascii", "Type of drive.", "cia402"),
    joint: tuple[float, float, float] = OPTIONS.option(
        "--joint J B K", "J, B, K in kg·m², N·m·s/rad, N·m/rad.", (0.0045, 0.1368, 1.751)
    ),
    rig_out: Path | None = OPTIONS.option("--rig-out FILE", "Write a rig file for it."),
    voluntary: float = OPTIONS.option(
        "--voluntary NM", "SD of the subject's voluntary torque.", 0.0
    ),
    torque_rate: float = OPTIONS.option(
        "--torque-rate-hz HZ", "Torque samples per second.", 1000.0
    ),
    noise: float = OPTIONS.option("--noise-nm NM", "SD of the torque noise.", 0.005),
    bandwidth: float = OPTIONS.option("--bandwidth-hz HZ", "Bandwidth of the drive.", 50.0),
    settings: Path | None = OPTIONS.option(
        "--settings FILE", "Motor and gear of the drive, its [rig.drive_side]."
    ),
    seed: int = OPTIONS.option("--seed", "Seed of all random numbers.", 1),
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
    from rigidimeter.core.settings import load_settings
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
            drive_side=load_settings(settings).rig.drive_side,
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
