"""How long and how often the position limit has held the command back.

A joint that is driven against the position limit is not being measured, and whoever is in the rig
is stopped there again and again. A tick is at the limit where the limit makes the command smaller.

time       c Δt, with c the ticks at the limit among those of the last `at_limit_of_s`.

arrivals   A tick at the limit after one that was not is an arrival, if the last one that counted is
           `apart_s` ago or more. t_n − t_(n−2) is the time that the last three of them span.

A step only adds and compares. What the ring holds is 0 where no tick of it was at the limit; it is
then not written, as which place comes next makes no difference.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class ContactState(NamedTuple):
    """What is remembered of the position limit.

    `at_limit` is a ring of 1 and 0, one entry a tick, written in place: was the limit at work;
    `place` is where the next is written, `ticks` the sum of all. `touching` says whether the last
    step was at the limit, `arrived_s` and `before_s` how long ago the last two arrivals were,
    `three_s` how long the last three took. `arrivals` counts all of them.
    """

    at_limit: NDArray[np.int64]
    place: int = 0
    ticks: int = 0
    touching: bool = False
    arrived_s: float = math.inf
    before_s: float = math.inf
    three_s: float = math.inf
    arrivals: int = 0


def contact_state(interval_s: float, of_s: float) -> ContactState:
    """Return the state of a joint that has never been at its limit, with a memory of `of_s`."""
    return ContactState(np.zeros(max(math.ceil(of_s / interval_s), 1), dtype=np.int64))


def contact_step(
    state: ContactState, at_limit: bool, passed: int, interval_s: float, apart_s: float
) -> ContactState:
    """Count one step, `passed` ticks after the one before, of which all were as this one is."""
    ring, place, ticks, touching, arrived_s, before_s, three_s, arrivals = state
    if at_limit or ticks > 0:
        now = 1 if at_limit else 0
        for _ in range(min(passed, ring.size)):
            ticks += now - int(ring[place])
            ring[place] = now
            place = place + 1 if place < ring.size - 1 else 0
    elapsed_s = passed * interval_s
    arrived_s, before_s = arrived_s + elapsed_s, before_s + elapsed_s
    if at_limit and not touching and arrived_s >= apart_s:
        three_s, before_s, arrived_s = before_s, arrived_s, 0.0
        arrivals += 1
    return ContactState(ring, place, ticks, at_limit, arrived_s, before_s, three_s, arrivals)


def forgotten(state: ContactState) -> ContactState:
    """Return the state that begins anew, but for the count of all arrivals."""
    state.at_limit[:] = 0
    return ContactState(state.at_limit, arrivals=state.arrivals)
