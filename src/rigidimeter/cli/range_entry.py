"""The range of motion of a person as it is entered on the terminal: typed, or led by hand."""

from __future__ import annotations

from pathlib import Path

from rigidimeter.cli.output import echo
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.rig.devices import MotionRange, load_rig


def entered_range(
    typed_deg: tuple[float, float] | None, rig: Path | None, settings: Settings, *, lead: bool
) -> MotionRange | None:
    """Return the range that was entered; None if none was.

    Raises
    ------
    UserError
        If it is no range, or cannot be led.
    """
    if typed_deg is not None and lead:
        raise UserError("--range-deg and --lead-range are two ways to say one thing; use one")
    if typed_deg is not None:
        return MotionRange(*typed_deg)
    if not lead:
        return None
    if rig is None:
        raise UserError(
            "--lead-range: the virtual rig has no arm to lead; use --range-deg LOW HIGH"
        )
    from rigidimeter.cli.rig_checks import claimed, operator, require_answers
    from rigidimeter.rig.commissioning import lead_range, record_path

    require_answers(yes=False)
    rigfile = load_rig(rig)
    again = "run again"
    with claimed(rigfile, settings, record_path(rig), again, operator()) as setup:
        found = lead_range(setup)
    echo(found.words[:1].upper() + found.words[1:] + ".", err=True)
    return found
