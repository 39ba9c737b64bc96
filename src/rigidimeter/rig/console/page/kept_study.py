"""The folder of the console's sessions as a study folder."""

from __future__ import annotations

from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files import STUDY_FILE, extend_study, read_study_toml
from rigidimeter.rig.console.page.desk import Place


def extended(place: Place) -> list[str]:
    """Add what was recorded to the study of the console's folder; return what is to be said.

    A page for one session may lie in any folder, which is not made a study.
    """
    if place.one_session:
        return []
    try:
        return extend_study(place.root, known=list(place.settings.subject))
    except (UserError, OSError) as error:
        return [f"not in the study: {error}"]


def off_scale(place: Place, score: float) -> str:
    """Return what is to be said of a score outside the study's scale; an empty text of others."""
    path = place.root / STUDY_FILE
    if place.one_session or not path.is_file():
        return ""
    try:
        low, high = read_study_toml(path).rating.scale
    except UserError:
        return ""  # the reading of the study says why
    if low <= score <= high:
        return ""
    return (
        f"noted, but {score:g} is outside the scale of {low:g} to {high:g} in {path}: rate the "
        "epoch again, or change `scale` there; the study cannot be compared until then"
    )
