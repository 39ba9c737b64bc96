"""Whether a delay between torque and motion that was found and not taken out moves J and B.

Torque that is stamped τ late makes of J s² + B s + K, to the first order in τ,

    (J − B τ) s² + (B − K τ) s + K

Where the perturbation was recorded, a delay is told from a reflex, friction and a soft cuff, and is
corrected or named as one of them. Without it a delay is known and its cause is not. Where the drive
is not known either, a delay as short as that of the acceleration at the ticks (`as_sampled`) may be
the drive's, which is in the interval of J.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.analysis.estimation.diagnostics.check_record import half_widths
from rigidimeter.core.records import Delay, Finding, Fit
from rigidimeter.core.settings import DiagnosticsSettings

SIGNIFICANT = 3.0
"""In standard errors."""


def torque_delay(
    fit: Fit, delays: Sequence[Delay], of_drive_s: float, settings: DiagnosticsSettings
) -> tuple[Finding, ...]:
    """Return the finding where the delay moves J or B by more than half their intervals.

    Parameters
    ----------
    fit : Fit
        By least squares, of an epoch whose perturbation is not known.
    delays : sequence of Delay
        Of all sources.
    of_drive_s : float
        Which delay may be the drive's.
    settings : DiagnosticsSettings
    """
    found = next((delay for delay in delays if delay.source == fit.source), None)
    if found is None or found.corrected or not fit.n_samples:
        return ()
    late_s = abs(found.delay_s)
    if not late_s > of_drive_s + SIGNIFICANT * found.delay_s_se:
        return ()
    moved = late_s * np.abs(fit.value[1:])
    share = float(np.max(moved / half_widths(fit)[:2]))
    if share <= 1.0:
        return ()
    late_ms, most_ms = 1e3 * found.delay_s, 1e3 * late_s / share
    text = (
        f"the torque is {late_ms:.3g} ms late against the motion (at most {most_ms:.2g} ms either "
        f"way), which was not corrected: if it is a delay, J is about {moved[0]:.2g} kg·m² off and "
        f"B {moved[1]:.2g} N·m·s/rad; if not, a reflex is in them, or torque that "
        "something but the robot adds"
    )
    remedy = (
        "record the perturbation, which tells the two apart; or take the delay out of the "
        "recording if it is known"
    )
    return (
        Finding("torque_delay", settings.levels.torque_delay, abs(late_ms), most_ms, text, remedy),
    )
