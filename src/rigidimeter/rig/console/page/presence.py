"""Whether an operator is at the page, and which of several pages it is.

The page that has control beats about twenty times a second, by a script of its own, so a page that
is closed, frozen, or cut off is silent. The time of its last beat is the console's heartbeat in the
shared status, which the loop looks at every tick: the server cannot beat for a page.

There is one exception. A page that says that it goes away, because it is reloaded, closed or no
longer in front, has its session paused: the arm is held still. As long as the loop shows that it is
paused, and for `AWAY_S` at most, it may come back. Then its silence counts again, and the loop ends
the session. Only the same tab may come back meanwhile; any other page can only look.
"""

from __future__ import annotations

from dataclasses import dataclass

AWAY_S = 20.0
"""For so long a page that said that it goes may be away from a paused session."""

SETTLES_S = 0.3
"""So long after it said so the loop may take to show that it is paused."""

SILENT_S = 0.45
"""A page that was silent for so long is lost: with the ramp to rest it is less than 0.5 s."""

_NS = 1_000_000_000


@dataclass
class Presence:
    """The page in control; each attribute is written by the server's thread alone.

    Attributes
    ----------
    page : str
        The secret of the page that has control; empty if none has.
    tab : str
        The browser's tab in which it was last, which may take control again after a reload.
    beat_ns : int
        When it was last heard of, on CLOCK_MONOTONIC.
    left_ns : int
        When it said that it goes; 0 while it is there.
    """

    page: str = ""
    tab: str = ""
    beat_ns: int = 0
    left_ns: int = 0

    def arrive(self, page: str, tab: str, now_ns: int, *, session: bool) -> bool:
        """Let a page in; return whether it has control.

        Parameters
        ----------
        page, tab : str
            Secrets of the page and of the tab.
        now_ns : int
        session : bool
            Whether a session runs: then only the tab that had control takes it again.
        """
        comes_back = tab == self.tab and (not self.page or self.left_ns > 0)
        free = self.lost(now_ns) or (not self.page and not session)
        if comes_back or free:
            self.page, self.tab = page, tab
            self.beat_ns, self.left_ns = now_ns, 0
        return self.page == page

    def has_control(self, page: str) -> bool:
        """Whether a page may act."""
        return bool(page) and page == self.page

    def beat(self, page: str, now_ns: int) -> None:
        """Take a beat of a page; of one that looks, nothing."""
        if self.has_control(page):
            self.beat_ns, self.left_ns = now_ns, 0

    def leave(self, page: str, now_ns: int) -> bool:
        """Take the word of a page that it goes; return whether it had control."""
        if not self.has_control(page):
            return False
        self.left_ns = now_ns
        return True

    def gone(self, page: str) -> None:
        """Take note that the connection to a page is closed."""
        if self.has_control(page):
            self.page = ""

    def seen_ns(self, now_ns: int, *, still: bool) -> int:
        """Return the heartbeat of the operator.

        Parameters
        ----------
        now_ns : int
        still : bool
            Whether the loop shows that the arm is held still.
        """
        if self.left_ns:
            away_ns = now_ns - self.left_ns
            if away_ns < SETTLES_S * _NS or (still and away_ns < AWAY_S * _NS):
                return now_ns
        return self.beat_ns

    def lost(self, now_ns: int) -> bool:
        """Whether the page that had control may no longer come back."""
        until_ns = self.left_ns + AWAY_S * _NS if self.left_ns else self.beat_ns + SILENT_S * _NS
        return now_ns > until_ns
