"""The folder of the console's sessions as a study folder."""

from __future__ import annotations

from rigidimeter.console.page.desk import Place
from rigidimeter.errors import UserError
from rigidimeter.study.extended_folder import extend_study


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
