"""What is heard of a session: a stop, or a caution, once as it begins.

The page has a tone for each, the terminal its bell. A stop is that the guard holds or has stopped
the rig, or that the session ended without success. A caution is an indicator that needs attention
(▲) or worse, or a torque that does not fit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from enum import IntEnum

from rigidimeter.rig.console.indicators import Level
from rigidimeter.rig.console.session_facts import Facts

AGAIN_S = 10.0
"""An indicator that goes to and fro is heard so seldom."""


GOES_ON, HELD, STOPPED = range(3)


class Alarm(IntEnum):
    """What is heard; the larger one matters more."""

    NONE = 0
    CAUTION = 1
    STOP = 2


class Alarms:
    """Follows one session from its beginning.

    Parameters
    ----------
    now : callable
        Monotonic seconds.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._halted = GOES_ON
        self._levels: dict[str, Level] = {}
        self._heard_s: dict[str, float] = {}
        self._cautions: set[str] = set()

    @property
    def stopped(self) -> bool:
        """Whether the stop of a session that does not go on was heard."""
        return self._halted == STOPPED

    def heard(self, facts: Facts, outcome: str, cautions: Sequence[str] = ()) -> Alarm:
        """Return what begins now.

        Parameters
        ----------
        facts : Facts
        outcome : str
            Of the session; empty as long as it runs.
        cautions : sequence of str
            What is wrong with the torque of epochs that have ended.
        """
        caution = self._caution(facts) | bool(set(cautions) - self._cautions)
        self._cautions |= set(cautions)
        before, self._halted = self._halted, _halted(facts, outcome)
        if self._halted > before:
            return Alarm.STOP
        # What has stopped the rig is an indicator too.
        return Alarm.CAUTION if caution and self._halted == GOES_ON else Alarm.NONE

    def _caution(self, facts: Facts) -> bool:
        """Return whether an indicator has become worse."""
        now_s, begins = self._now(), False
        for one in facts.indicators:
            worse = one.level > max(self._levels.get(one.name, Level.UNKNOWN), Level.GOOD)
            self._levels[one.name] = one.level
            if worse and now_s - self._heard_s.get(one.name, -AGAIN_S) >= AGAIN_S:
                self._heard_s[one.name], begins = now_s, True
        return begins


def _halted(facts: Facts, outcome: str) -> int:
    if not facts.stop_words or outcome == "success":
        return GOES_ON
    return HELD if facts.held else STOPPED
