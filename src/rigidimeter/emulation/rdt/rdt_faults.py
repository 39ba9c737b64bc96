"""What the sensor's wire peer can be told to do wrong."""

from __future__ import annotations

__all__ = ["MISBEHAVIOURS", "ONCE", "STATUS", "SUPPLY_LOW", "Faults", "fault_value"]

MISBEHAVIOURS = {
    "silent": "No record is sent any more.",
    "deaf": "Requests to start are ignored.",
    "frozen_sequence": "The RDT sequence stands still; the values flow.",
    "frozen_ft_sequence": "The FT sequence stands still; all else flows.",
    "frozen_values": "The six counts stand still; the sequences flow.",
    "frozen_record": "One and the same record is sent again and again.",
    "saturated": "The saturation bit is set and the torque clipped.",
    "serious_status": "The status bits `value` are set (the supply of the analog board too low).",
    "one_bad_status": "One record alone carries the status bits `value`.",
    "warning": "A monitored condition is latched: a warning.",
    "lose": "Every `value`-th record (10) is not sent.",
    "lose_once": "`value` records (1) are not sent, once.",
    "duplicate": "Every `value`-th record (10) is sent twice.",
    "duplicate_once": "One record is sent twice, once.",
    "reorder": "Every `value`-th record (10) is sent after the one that follows it.",
    "reorder_once": "One record is sent after the one that follows it, once.",
    "short": "Every `value`-th record (10) ends after 20 bytes.",
    "long": "Every `value`-th record (10) has 4 bytes too many.",
    "garbage": "Every `value`-th record (10) is 36 random bytes.",
    "backlog": "Records are held for `value` s (0.05), then sent all at once, again and again.",
    "flood": "Every record is sent `value` times (50).",
    "restart": "The sensor restarts, once: both sequences begin at 1 again.",
    "foreign": "Another sender sends records with wrong torques to the client.",
    "bias": "The torque is off by `value` N·m (1), as after a bias under load.",
    "spike": "Every `value`-th record (100) shows 50 N·m more.",
    "changed_units": "The page says lbf-in.",
    "unknown_units": "The page says a torque unit that nobody knows.",
    "changed_calibration": "The page says another transducer with twice the counts.",
    "changed_bias": "The page says another software bias.",
    "rdt_disabled": "The page says that RDT is disabled.",
    "page_status": "The page says the status bits `value` (the supply too low).",
    "http_silent": "The web server takes requests and does not answer.",
    "http_slow": "The web server answers after `value` s (0.5).",
    "http_drip": "The web server sends the page a byte every `value` s (0.1).",
    "http_error": "The web server answers 500.",
    "http_garbage": "The web server answers with something else than the page.",
}
"""What a peer can be told to do wrong, by name."""

SUPPLY_LOW = 0x80000020
STATUS = {"saturated": 0x80020000, "warning": 0x80010000}
ONCE = {"lose_once", "duplicate_once", "reorder_once", "restart", "one_bad_status"}

Faults = dict[str, float | None]
"""What is done wrong now, with its value; None stands for the one in the sentence."""


def fault_value(faults: Faults, name: str, default: float) -> float | None:
    """Return the value of a misbehaviour that is on, None if it is off."""
    if name not in faults:
        return None
    value = faults[name]
    return default if value is None else value
