"""What leaves the program while a session runs, and when it has ended."""

from __future__ import annotations

from pydantic import Field

from rigidimeter.settings.section import Section


class SharingSettings(Section):
    """Streams of Lab Streaming Layer during a session of `run`, and NWB after it.

    Parameters
    ----------
    lsl : bool
        Send samples and markers as streams.
    lsl_name : str
        Name of the stream of samples; that of the markers ends in ``Markers``.
    lsl_conditions : bool
        Whether conditions are in the markers; not where who records must not know them.
    nwb_at_close : bool
        Write ``SESSION.nwb`` beside the session folder when the session has ended.
    """

    lsl: bool = False
    lsl_name: str = Field("ElbowRobot", min_length=1, max_length=60)
    lsl_conditions: bool = True
    nwb_at_close: bool = False
