"""How soon the guard would find a torque sensor of the wrong sign, as a terminal shows it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rigidimeter.cli.progress import Meter
from rigidimeter.cli.terminal_tables import Block, Table
from rigidimeter.guard import Cause

if TYPE_CHECKING:
    from rigidimeter.commissioning import Check, Search, TurnedEpochs
    from rigidimeter.settings import Settings

DAILY = (
    "repeat `rigidimeter check`, which measures it with nobody in the rig, before every session."
)
IMPOSED = "In an imposed sinusoid the guard does not see the sign."


def sign_blocks(settings: Settings, checks: Sequence[Check]) -> Iterator[Block]:
    """Simulate epochs with the sign turned, and yield what became of them.

    Parameters
    ----------
    settings : Settings
        Of the protocol.
    checks : sequence of Check
        Of the rig; the noise of the torque is taken from them.
    """
    from rigidimeter.commissioning import (
        measured_noise_nm,
        perturbed_conditions,
        search_for_turned_sign,
    )

    if not perturbed_conditions(settings):
        yield (
            "This protocol has no torque perturbation: the guard cannot find a wrong sign of the "
            f"torque. So {DAILY}"
        )
        return
    noise_nm = measured_noise_nm(checks)
    shown_nm = settings.rig.torque.noise_sd_nm if noise_nm is None else noise_nm
    yield (
        "If the torque sensor had the wrong sign: simulated PRBS epochs, perturbation "
        f"±{settings.prbs.amplitude_nm:g} N·m, noise of the torque {shown_nm:.2g} N·m (SD)."
    )
    # Epochs end when the sign is found, and no further ones follow once it is not.
    with Meter("simulate the wrong sign", 1.0, foreseen=False) as meter:
        found = search_for_turned_sign(settings, noise_nm, meter.advance)
    yield from found_blocks(found)
    if any(block.task == "sinusoid" for block in settings.protocol.blocks):
        yield IMPOSED


def found_blocks(search: Search) -> Iterator[Block]:
    """Yield a row for each own torque, and what follows from them."""
    headings = ("subject", "own\ntorque", "found", "after\n(range)", "arm at\nmost", "else")
    yield Table(headings, [_row(epochs) for epochs in search.tried], "<====<")
    hidden = [epochs for epochs in search.tried if not epochs.all_found]
    if not hidden:
        return
    least_nm = min(epochs.own_torque_nm for epochs in hidden)
    words = (
        f"With {least_nm:g} N·m of own torque the guard does not always find it"
        if least_nm
        else "Even of a subject without any own torque the guard does not always find it"
    )
    better = search.larger
    if better is None:
        larger = "no larger perturbation that was tried helps"
    else:
        larger = (
            f"with prbs.amplitude_nm = {better.amplitude_nm:g} it does, after "
            f"{min(better.found_s):.1f} to {max(better.found_s):.1f} s, the arm at up to "
            f"{better.farthest_deg:.0f} deg"
        )
    yield (f"{words}; {larger}. {'So' if better is None else 'Otherwise'} {DAILY}")


def _row(epochs: TurnedEpochs) -> tuple[str, ...]:
    found_s = epochs.found_s
    after = "–"
    if found_s:
        after = f"{epochs.median_s:.2f} s ({min(found_s):.2f}–{max(found_s):.2f})"
    others = [_ended(*ends) for ends in sorted(epochs.ended_s.items())]
    return (
        epochs.condition,
        f"{epochs.own_torque_nm:g} N·m",
        f"{len(found_s)} of {epochs.epochs}",
        after,
        f"{epochs.farthest_deg:.0f} deg",
        ", ".join(filter(None, others)),
    )


def _ended(cause: Cause, ends_s: Sequence[float]) -> str:
    """Return what else ended how many epochs, and when; empty where it was the sign."""
    if cause is Cause.TORQUE_SIGN:
        return ""
    if cause is Cause.NONE:
        return f"{len(ends_s)} not within {max(ends_s):g} s"
    name = cause.name.lower().replace("_", " ")
    return f"{len(ends_s)} {name} ({min(ends_s):.2f}–{max(ends_s):.2f} s)"
