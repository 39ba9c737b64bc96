"""What J loses where the samples are taken as they are, as least squares takes them."""

from __future__ import annotations

from rigidimeter.estimation.closedloop.between_samples import acceleration_seen
from rigidimeter.estimation.prepared import PreparedEpoch
from rigidimeter.records import Finding

REMEDY = (
    "use --method iv with the perturbation recorded, which corrects it; or sample faster, or give "
    "the drive a lower bandwidth"
)


def between_samples_as_they_are(prepared: PreparedEpoch) -> tuple[Finding, ...]:
    """Return the finding `between_samples` if the drive shows that J comes out wrong."""
    found, epoch = prepared.source.drive, prepared.epoch
    command = epoch.channels.get("velocity_command_rad_s")
    if found is None or command is None:
        return ()
    settings = prepared.settings.diagnostics
    seen = acceleration_seen(found.model, command, epoch.channels["torque_nm"].time_s)
    percent, most = 100.0 * abs(1.0 - seen), settings.between_samples_most_percent
    if not percent > most:
        return ()
    text = (
        f"the torque was sampled where the acceleration is {100 * seen:.3g} % of its mean between "
        f"the samples (at most {most:g} % away), and J is taken to be as much too "
        f"{'small' if seen < 1 else 'large'}"
    )
    return (
        Finding("between_samples", settings.levels.between_samples, percent, most, text, REMEDY),
    )
