"""The days of a study: which conditions on which day, in which order, after which wait.

Nothing is written here. A day with both conditions has its sessions in one of two forms:

- one session of each condition, in an order that is balanced: of each pair of such days one has
  the order drawn for the pair, the other its reverse;
- several sessions of each, drawn from all orders with at most two of one condition in a row; the
  second day of a pair has the reverse order.

A wait precedes every session in which the stimulation is not as it was in the session before, and
the first of a day, before which its state is unknown. Where examiners are blinded the longer
wait precedes every session, for its length would give the condition away.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files import PlannedBlock

AT_MOST_ALIKE = 2
"""Sessions of one condition in a row, where there are several a day."""

_ORDERS = 0
"""The stream of the seed from which orders are drawn."""

_MOST_SESSIONS = 12
"""A day."""

_MOST_ORDERS = 120_000
"""So many orders of a day can still be listed."""

_MOST_SUBJECTS = 1000
_MOST_PLANNED = 10_000
"""Sessions of a plan, which is read again before each of them."""


class WrongValue(UserError):
    """A value of a plan that is wrong: which one, and what would be right.

    Attributes
    ----------
    key : str
        The option of `study plan`, with ``_`` in place of ``-``. Its sentence in `places` is
        without the option.
    """

    def __init__(self, key: str, sentence: str, text: str | None = None) -> None:
        where = "" if text is None else f"--{key.replace('_', '-')} {text}: "
        super().__init__(f"{where}{sentence}", places={key: sentence})
        self.key = key


@dataclass(frozen=True)
class StudyDays:
    """What a plan is drawn from.

    Attributes
    ----------
    subjects : tuple of str
    conditions : tuple of str
        The reference first.
    stimulated : tuple of str
        The conditions with the stimulation on.
    days : int
        Of each subject.
    days_of : mapping of str to int
        On how many of them a condition is recorded, where not on all; they are spread evenly.
    sessions_a_day : int
        Of each condition.
    order : tuple of str
        A given order of conditions; empty to have it drawn.
    balanced : bool
        Whether the second day of each pair has the reverse order of the first.
    wait_after_on_min, wait_after_off_min : float
    task : str
    raters : tuple of str
    codes : mapping of str to str
        What stands for each condition where examiners are blinded; empty where they are not.
    """

    subjects: tuple[str, ...]
    conditions: tuple[str, ...]
    days: int
    stimulated: tuple[str, ...] = ()
    days_of: Mapping[str, int] = field(default_factory=dict)
    sessions_a_day: int = 1
    order: tuple[str, ...] = ()
    balanced: bool = True
    wait_after_on_min: float = 15.0
    wait_after_off_min: float = 60.0
    task: str = "prbs sinusoid"
    raters: tuple[str, ...] = ()
    codes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, count in self.days_of.items():
            if name not in self.conditions:
                raise WrongValue(
                    "days_of", f"condition {name}: is not one of {', '.join(self.conditions)}"
                )
            if not 1 <= count <= self.days:
                raise WrongValue(
                    "days_of",
                    f"condition {name} on {count} days: must be from 1 to the {self.days} days of "
                    "the study",
                )
        if self.order and sorted(self.order) != sorted(self.conditions):
            raise WrongValue(
                "order",
                f"order {', '.join(self.order)}: must name each of the conditions "
                f"{', '.join(self.conditions)} once",
            )
        if self.sessions_a_day * len(self.conditions) > _MOST_SESSIONS:
            raise WrongValue(
                "sessions",
                f"{self.sessions_a_day} sessions a day of {len(self.conditions)} conditions: at "
                f"most {_MOST_SESSIONS} sessions a day can be planned",
            )
        if len(self.subjects) > _MOST_SUBJECTS:
            raise WrongValue(
                "subjects",
                f"{len(self.subjects)} subjects: at most {_MOST_SUBJECTS} can be planned at once",
            )
        planned = self._planned_count()
        if planned > _MOST_PLANNED:
            raise WrongValue(
                "days",
                f"{self.days} days of {len(self.subjects)} subjects have {planned} sessions: at "
                f"most {_MOST_PLANNED} can be planned at once",
            )
        if not self.order and self._order_count() > _MOST_ORDERS:
            raise WrongValue(
                "order",
                f"{self.sessions_a_day} sessions a day of {len(self.conditions)} conditions have "
                "too many orders to draw one; give the order, such as "
                f"{','.join(self.conditions)}",
            )

    def _planned_count(self) -> int:
        """Return how many sessions the plan has."""
        a_subject = sum(self.days_of.get(name, self.days) for name in self.conditions)
        return a_subject * self.sessions_a_day * len(self.subjects)

    def _order_count(self) -> int:
        """Return how many orders a day with all conditions has, alike ones in a row included."""
        k, n = self.sessions_a_day, len(self.conditions)
        return math.factorial(k * n) // int(math.factorial(k) ** n)

    def protocol_of(self, condition: str) -> str:
        """Return the settings file of a condition, whose name tells a blinded examiner nothing."""
        return f"protocols/{self.codes.get(condition, condition)}.toml"


def evenly(count: int, days: int) -> tuple[int, ...]:
    """Return `count` of the days 1 to `days`, spread evenly.

    Examples
    --------
    >>> evenly(4, 9)
    (2, 4, 6, 8)
    >>> evenly(3, 3)
    (1, 2, 3)
    """
    return tuple(int((2 * k + 1) * days / (2 * count)) + 1 for k in range(count))


def orders(conditions: Sequence[str], times: int) -> list[tuple[str, ...]]:
    """Return every order with each condition so many times and at most two alike in a row.

    Examples
    --------
    >>> orders(["OFF", "DBS"], 1)
    [('DBS', 'OFF'), ('OFF', 'DBS')]
    >>> len(orders(["OFF", "DBS"], 4))
    34
    """
    found: list[tuple[str, ...]] = []

    def extend(so_far: tuple[str, ...]) -> None:
        if len(so_far) == times * len(conditions):
            found.append(so_far)
            return
        for name in sorted(conditions):
            alike = so_far[-AT_MOST_ALIKE:] == (name,) * AT_MOST_ALIKE
            if so_far.count(name) < times and not alike:
                extend((*so_far, name))

    extend(())
    return found


@lru_cache(maxsize=8)
def _listed(conditions: tuple[str, ...], times: int) -> tuple[tuple[str, ...], ...]:
    """Return the same as `orders`, listed once for all days of a plan."""
    return tuple(orders(conditions, times))


def draw_days(plan: StudyDays, seed: int) -> tuple[PlannedBlock, ...]:
    """Return the sessions of a study, those of each subject and day in their order.

    Equal seeds give equal plans; each subject has a stream of its own.

    Raises
    ------
    ValueError
        If the seed is negative.
    """
    there = {
        name: set(evenly(plan.days_of.get(name, plan.days), plan.days)) for name in plan.conditions
    }
    blocks: list[PlannedBlock] = []
    for number, subject in enumerate(plan.subjects):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_ORDERS, number)))
        reverse: dict[tuple[str, ...], tuple[str, ...]] = {}
        for day in range(1, plan.days + 1):
            names = tuple(name for name in plan.conditions if day in there[name])
            order = _order_of(names, plan, rng, reverse)
            blocks += _blocks(subject, str(day), order, plan)
    return tuple(blocks)


def _order_of(
    names: tuple[str, ...],
    plan: StudyDays,
    rng: np.random.Generator,
    reverse: dict[tuple[str, ...], tuple[str, ...]],
) -> tuple[str, ...]:
    """Return the order of a day with these conditions."""
    if plan.order:
        return tuple(name for name in plan.order if name in names) * plan.sessions_a_day
    if plan.balanced and names in reverse:
        return reverse.pop(names)
    possible = _listed(names, plan.sessions_a_day) if len(names) > 1 else ()
    order = possible[rng.integers(len(possible))] if possible else names * plan.sessions_a_day
    if plan.balanced and len(names) > 1:
        reverse[names] = order[::-1]
    return order


def _blocks(subject: str, day: str, order: Sequence[str], plan: StudyDays) -> list[PlannedBlock]:
    """Return the sessions of a day with the waits before them."""
    found = []
    for k, (before, name) in enumerate(itertools.pairwise(("", *order)), start=1):
        on = name in plan.stimulated
        changed = not before or (before in plan.stimulated) != on
        wait = plan.wait_after_on_min if on else plan.wait_after_off_min
        if plan.codes:
            changed, wait = True, max(plan.wait_after_on_min, plan.wait_after_off_min)
        found.append(
            PlannedBlock(
                subject, day, k, name, plan.task, plan.protocol_of(name),
                wait if changed and plan.stimulated else 0.0, " ".join(plan.raters),
            )
        )  # fmt: skip
    return found
