"""What a difference takes, in a sentence: of the command line's document and of the page."""

from __future__ import annotations

from rigidimeter.core.study_files import primary_words
from rigidimeter.planning.days_needed import Detection


def plan_sentence(found: Detection) -> str:
    """Return how many days like the planned one, or subjects, show a difference.

    Parameters
    ----------
    found : Detection
    """
    percent = 100.0 * found.difference / found.value
    what = (
        f"To detect {abs(percent):.3g} % {'less' if percent > 0 else 'more'} "
        f"{found.wanted.parameter}"
    )
    if found.planned is None:
        return (
            f"{what}, a day needs PRBS epochs in two conditions; the protocol has them in one or "
            "none."
        )
    one = found.planned
    alone = ""
    if one.days_alone != one.days:
        alone = f" ({count_words(one.days_alone)} if it were the only primary measure)"
    role = ""
    if found.before:
        role = f" after {' and '.join(b.wanted.parameter for b in found.before)} is shown"
    elif found.level != found.alpha:
        role = f" among {primary_words(found.primary)}"
    x, y = one.epochs
    return (
        f"{what}{role} (chance {100 * found.power:.3g} %): {count_words(one.days)} days with "
        f"{x} + {y} epochs{alone}, or {count_words(one.subjects)} subjects with one day each. "
        f"Assumed SD: {found.scatter}; between subjects "
        f"{100 * found.scatter.between_subjects:.0f} % of the difference (chosen)."
    )


def count_words(needed: int | None) -> str:
    """Return a number of days or subjects; None stands for more than the search tried.

    Examples
    --------
    >>> count_words(8), count_words(None)
    ('8', '> 1000')
    """
    return "> 1000" if needed is None else f"{needed}"
