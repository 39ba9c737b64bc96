"""The form of a plan of days: what can be entered, and what plan it asks for.

Its keys are those of `PlanValues`, the options of `study plan`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.planning import DrawnPlan, PlanValues, draw_plan
from rigidimeter.planning import plan_days_of as read_days_of
from rigidimeter.planning import plan_names as read_names
from rigidimeter.rig.console.page.form_values import parse_integer, parse_number, parse_numbers
from rigidimeter.rig.console.page.session_form import YES, Field, placed

WHO = (
    Field("subjects", "Subjects (codes)"),
    Field("days", "Days of each subject"),
    Field("conditions", "Conditions, the reference first"),
    Field("stimulated", "Stimulation is on in"),
    Field("days_of", "Fewer days of a condition"),
)
IN_A_DAY = (
    Field("sessions", "Sessions a day of each condition, alternating"),
    Field("seed", "Seed of the orders"),
)
SESSION = (
    Field("prbs_epochs", "PRBS epochs of a session"),
    Field("sinusoid_epochs", "Sinusoidal epochs of a session"),
    Field("rests_s", "Rest between epochs", "s"),
    Field("raters", "Raters in each session"),
)
WAITS = (
    Field("wait_after_on", "Wait after switching on", "min"),
    Field("wait_after_off", "Wait after switching off", "min"),
)
GIVEN = Field("given", "The order")

EXAMPLES = {
    "subjects": "S01,S02",
    "stimulated": "all but the first",
    "days_of": "DBS=4",
    "rests_s": "as in the settings (10; 20: drawn)",
    "raters": "A,B",
    "given": "OFF,DBS",
    "seed": "2023; drawn if blinded",
}
"""What an empty field shows."""

ORDERS = {
    "balanced": "balanced: reversed on every second day",
    "drawn": "drawn for each day",
    "given": "given, the same on all days",
}
WAITS_AFTER_OFF = {"60": "60 min", "30": "30 min", "15": "15 min, as in the paper"}
"""The choices that have a name."""

_WHOLE = ("days", "sessions", "seed", "prbs_epochs", "sinusoid_epochs")
_NUMBERS = ("wait_after_on", "wait_after_off")
_NAMES = ("subjects", "conditions", "stimulated", "raters", "given")
_NEEDED = ("subjects", "conditions")
_LABELS = {one.key: one.label for one in (*WHO, *IN_A_DAY, *SESSION, *WAITS)}


@dataclass(frozen=True)
class EnteredPlan:
    """What a form asks for; `plan` is None as long as something is wrong.

    `errors` has a sentence for each field, under the key "" what belongs to none.
    """

    plan: DrawnPlan | None
    errors: Mapping[str, str]
    values: PlanValues | None = None


def empty_plan_form() -> dict[str, str]:
    """Return the form that `study plan` without options is."""
    usual = PlanValues(("",))
    numbers = {key: getattr(usual, key) for key in (*_WHOLE, *_NUMBERS)}
    return dict.fromkeys(EXAMPLES, "") | {
        **{key: f"{value:g}" for key, value in numbers.items() if value is not None},
        "conditions": ",".join(usual.conditions),
        "order": usual.order,
        "blinded": "",
    }


def read_plan_form(form: Mapping[str, str], base: Settings) -> EnteredPlan:
    """Draw the plan that a form asks for, or say what is wrong with it.

    Parameters
    ----------
    form : mapping of str to str
    base : Settings
        What the sessions share.
    """
    errors: dict[str, str] = {}
    found: dict[str, Any] = {"order": form["order"], "blinded": form["blinded"] == YES}
    for key in (*_WHOLE, *_NUMBERS, *_NAMES, "days_of", "rests_s"):
        text = form[key].strip()
        if not text and key in EXAMPLES and key not in _NEEDED:
            continue
        try:
            found[key] = _read(key, text)
        except UserError as error:
            errors[key] = error.places.get(key, str(error))
    if form["order"] != "given":
        found.pop("given", None)
        errors.pop("given", None)
    elif "given" not in found:
        errors.setdefault("given", "write the conditions in their order, such as OFF,DBS")
    if errors:
        return EnteredPlan(None, errors)
    values = None
    try:
        values = PlanValues(**found)
        return EnteredPlan(draw_plan(values, base), {}, values)
    except UserError as error:
        at = {"order": "given"} if form["order"] == "given" else {}
        at["protocol.rests_s"] = "rests_s"
        return EnteredPlan(None, placed(error, {key: key for key in form} | at), values)


def _read(key: str, text: str) -> Any:
    if key in _NAMES:
        return read_names(text, key)
    if key == "days_of":
        return read_days_of([one for one in text.replace(";", ",").split(",") if one.strip()])
    if key == "rests_s":
        return tuple(parse_numbers(text, "rests"))
    return (parse_integer if key in _WHOLE else parse_number)(text, _LABELS[key])


_RETURNS = "Rigidity returns in 30 to 60 min"


def wait_leaves(minutes: float) -> str:
    """Return what a wait after switching off leaves of the stimulation's effect.

    Examples
    --------
    >>> wait_leaves(15.0)
    'Some of the effect is left, as in the paper: the difference is measured too small.'
    """
    if minutes >= 60.0:
        return f"{_RETURNS}: the effect of stimulation is gone in most subjects."
    if minutes >= 30.0:
        return f"{_RETURNS}: some of the effect may be left, and make the difference too small."
    return "Some of the effect is left, as in the paper: the difference is measured too small."
