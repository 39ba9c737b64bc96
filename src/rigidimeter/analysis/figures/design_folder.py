"""The folder of a design: what will be commanded, what is predicted, and the Bode diagram.

The diagram is that of the open loop of the admittance on the arm, with the margins marked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from rigidimeter.analysis.figures.curves import frequency_axis
from rigidimeter.analysis.figures.style import (
    GREY,
    condition_colours,
    drawable,
    drawn,
    note,
    svg_text,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import DICTIONARY, csv_text, dictionary_text, write_json, write_text
from rigidimeter.core.settings import Settings
from rigidimeter.model import Loop, Margins
from rigidimeter.planning import Design, design_document, prbs_toml

_LOWEST_HZ = 0.01
_FLOOR_DB = -80.0


def write_design_folder(folder: Path, design: Design) -> list[str]:
    """Write what will be commanded and what is predicted; return the names of the files.

    Raises
    ------
    UserError
        If the folder cannot be made or a file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{folder}: cannot be made a folder ({error.strerror or error})") from None
    motion = (design.angle_rad.tolist(), design.velocity_rad_s.tolist())
    epochs = [vars(epoch) for epoch in design.protocol.epochs]
    loop = design.settings, design.stability.conditions, design.stability.worst
    texts = {
        "prbs.csv": _columns(design, ["perturbation_nm"], [design.perturbation_nm.tolist()]),
        "sinusoid.csv": _columns(design, ["angle_rad", "velocity_rad_s"], motion),
        "protocol.csv": csv_text(list(epochs[0]), epochs),
        "bode.svg": svg_text(drawn((7.4, 5.4), draw_bode, *loop, rows=2, sharex=True)),
    }
    if design.multisine is not None:
        torque = [design.multisine.torque_nm.tolist()]
        texts["multisine.csv"] = _columns(design, ["perturbation_nm"], torque)
    if design.ranked is not None:
        texts["optimised.toml"] = prbs_toml(design.ranked[0].prbs)
    tables = {name: text.partition("\n")[0].split(",") for name, text in texts.items()
              if name.endswith(".csv")}  # fmt: skip
    texts[DICTIONARY] = dictionary_text(tables)
    for name, text in texts.items():
        write_text(folder / name, text)
    write_json(folder / "design.json", design_document(design))
    return [*texts, "design.json"]


def _columns(design: Design, names: list[str], columns: Sequence[list[float]]) -> str:
    rate_hz = design.settings.rig.tick_rate_hz
    times_s = [tick / rate_hz for tick in range(len(columns[0]))]
    return csv_text(["time_s", *names], zip(times_s, *columns, strict=True))


def draw_bode(
    panels: Sequence[Axes],
    settings: Settings,
    margins: Mapping[str, Margins],
    worst: Mapping[str, Margins],
) -> None:
    """Draw L(jω) for each condition, and dashed for the worst joint around each.

    Parameters
    ----------
    panels : sequence of Axes
        Two: magnitude and phase.
    settings : Settings
        For the loop.
    margins, worst : mapping of str to Margins
        By condition, as `rigidimeter.model.loop_stability` finds them.
    """
    above, below = panels
    highest_hz = settings.rig.tick_rate_hz / 2.0
    frequency_hz = np.geomspace(_LOWEST_HZ, highest_hz, 1200)
    loop = Loop(settings.controller, settings.rig).at_frequency(frequency_hz)
    above.axhline(0.0, color=GREY, linewidth=0.8)
    below.axhline(-180.0, color=GREY, linewidth=0.8)
    for name, colour in condition_colours(margins).items():
        for found, line, which in ((margins[name], "-", ""), (worst[name], "--", ", worst joint")):
            curve = loop.gain(found.joint.parameters)
            decibel = 20.0 * np.log10(np.maximum(np.abs(curve), 1e-12))
            phase_deg = np.degrees(np.unwrap(np.angle(curve)))
            label = f"{drawable(name)}{which}: {_in_numbers(found)}"
            above.plot(frequency_hz, decibel, line, color=colour, label=label)
            seen = decibel > _FLOOR_DB  # the phase of next to nothing says nothing
            below.plot(frequency_hz[seen], phase_deg[seen], line, color=colour)
            # A bar from the curve to the line that it must not cross, 0 dB and ±180 deg.
            at_margin = float(np.interp(found.phase_margin_hz, frequency_hz, phase_deg))
            gain, phase = found.gain_margin_db, found.phase_margin_deg
            for axes, at_hz, ends, shown in (
                (above, found.gain_margin_hz, (0.0, -gain), abs(gain) <= -_FLOOR_DB),
                (below, found.phase_margin_hz, (at_margin - phase, at_margin), np.isfinite(phase)),
            ):
                if shown:
                    axes.plot([at_hz] * 2, ends, color=colour, marker="_", lw=2.0, alpha=0.7)
    for axes in panels:
        frequency_axis(axes, _LOWEST_HZ, highest_hz)
    above.set_xlabel("")
    above.set_ylabel("|L| (dB)")
    above.set_ylim(bottom=_FLOOR_DB)
    above.yaxis.set_major_locator(MultipleLocator(20.0))
    above.legend(loc="lower left")
    below.set_ylabel("Phase of L (deg)")
    below.set_ylim(-360.0, 90.0)
    below.yaxis.set_major_locator(MultipleLocator(90.0))
    note(above, "bars: gain margins, where the phase is −180 deg")
    note(below, "bars: phase margins, where |L| is 0 dB")


def _in_numbers(found: Margins) -> str:
    if not found.stable:
        return "unstable"
    gain, phase = found.gain_margin_db, found.phase_margin_deg
    return ", ".join(
        f"{value:.{digits}f} {unit}" if np.isfinite(value) else f"no crossing of {where}"
        for value, digits, unit, where in ((gain, 1, "dB", "−180 deg"), (phase, 0, "deg", "0 dB"))
    )
