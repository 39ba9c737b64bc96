"""Whoever leads a session is gone, at random moments of it: when the arm stops, and what follows.

A session on the virtual rig, on a simulated clock that loop, shared memory and the page's server
have in common. The page is closed with a word (a closed tab), without one (a crash, a network that
is gone), or the terminal is closed (SIGHUP).
"""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import Command, Order, run_session
from rigidimeter.rig.acquisition.processes import (
    Flag,
    RingSink,
    Role,
    SessionMemory,
    SharedSupervision,
    ring_writer,
)
from rigidimeter.rig.console.page import SILENT_S, Place, ServerState
from rigidimeter.rig.devices import SimulatedRig

RATE_HZ = 250.0
NS = 1_000_000_000
BEGAN_NS = 1000 * NS
BEATS_S = 0.05
SENSOR = {"rate_hz": RATE_HZ}
SETTINGS = parse_settings(
    {
        "rig": {"tick_rate_hz": RATE_HZ, "torque": SENSOR, "motion": SENSOR},
        "guard": {"reaction_time_s": 0.05},
        "loop": {"console_lost_s": SILENT_S},
        "prbs": {"duration_s": 4.0},
        "zeroing": {"duration_s": 2.0},
        "protocol": {"blocks": [{"epochs": 3}], "rests_s": [2.0], "return_s": 8.0},
    }
)
PAUSED_S, RESUMED_S = 18.0, 20.0
"""An operator pauses the second epoch, and resumes."""

PHASES = ("zeroing", "epoch", "return", "rest", "way back")
SPANS_S = {
    "zeroing": (0.1, 1.9),
    "epoch": (2.2, 5.9),
    "return": (7.0, 13.0),
    "rest": (14.4, 16.1),
    "way back": (21.2, 26.5),
}
"""In these times of the session each runs; a test holds them."""

HOW = ("tab closed", "page lost", "terminal closed")


class Closed(NamedTuple):
    """What came after it: until zero is commanded for good, and from then on, until the end."""

    how: str
    phase: str
    at_s: float
    zero_s: float
    motion_deg: float
    end_s: float
    phase_then: int
    reason: str


class _World:
    """The clock of all, the page's server, and who leaves when."""

    def __init__(self, folder: Path, how: str, at_s: float) -> None:
        self.now_s, self.how, self.at_s = 0.0, how, at_s
        self.gone = False
        self.phase = -1
        with patch("rigidimeter.rig.acquisition.processes.shared_memory.WHERE", folder):
            self.memory = SessionMemory.create(RATE_HZ, 120.0)
        self.server = ServerState(Place(folder, SETTINGS, ""), now_ns=self.now_ns)
        self.server.presence.arrive("page", "tab", self.now_ns(), session=False)
        self.look = self.server.console(None, folder)  # type: ignore[arg-type]
        self.loop: Any = None
        self._due_s = -math.inf
        self._orders = [(PAUSED_S, Command.PAUSE_NOW), (RESUMED_S, Command.RESUME)]

    def now_ns(self) -> int:
        return BEGAN_NS + round(NS * self.now_s)

    def wait_until(self, deadline_s: float) -> float:
        """Wait as the loop's clock does; the others act meanwhile."""
        self.now_s = max(self.now_s, deadline_s)
        status, presence = self.memory.status, self.server.presence
        status.beat(Role.RECORDER, self.now_ns())
        self.memory.samples.recorded = self.memory.samples.written
        self.memory.events.recorded = self.memory.events.written
        if self._orders and not self.gone and self.now_s >= self._orders[0][0]:
            status.post(Order(self._orders.pop(0)[1]))
        if self.now_s >= self.at_s and not self.gone:
            self.gone, self.phase = True, int(self.loop.phase)
            if self.how == "tab closed":
                presence.leave("page", self.now_ns())
                status.post(Order(Command.PAUSE_NOW))
            if self.how == "terminal closed":
                status.raise_flag(Flag.END_ASKED)
            presence.gone("page")
        if self.now_s >= self._due_s:
            self._due_s = self.now_s + BEATS_S
            if not self.gone:
                presence.beat("page", self.now_ns())
            self.look(self.memory)
            seen_ns = self.server.operator_seen_ns()
            terminal = self.how == "terminal closed"
            status.beat(Role.CONSOLE, self.now_ns() if terminal else seen_ns)
        return deadline_s

    def watch(self, loop: Any) -> None:
        self.loop = loop


def closed(folder: Path, how: str, phase: str, at_s: float) -> Closed:
    """Run a session whose operator is gone from a moment on; return what came of it."""
    world = _World(folder, how, at_s)
    memory = world.memory
    sink = RingSink(memory, RATE_HZ)
    rows: list[tuple[float, float, float]] = []

    def sample(taken: Any) -> None:
        RingSink.sample(sink, taken)
        rows.append((taken.time_s, taken.velocity_command_rad_s, taken.angle_rad))

    supervision = SharedSupervision(
        memory, console_lost_s=SILENT_S, now_ns=world.now_ns, boot_ns=world.now_ns
    )
    rig = SimulatedRig(SETTINGS.rig, SETTINGS.subject["OFF"], np.random.default_rng(1))
    recorded = SimpleNamespace(sample=sample, event=sink.event, close=sink.close)
    with patch.object(ring_writer, "monotonic_ns", world.now_ns):
        result = run_session(
            plan(SETTINGS.protocol, SETTINGS.prbs, SETTINGS.sinusoid, 1),
            SETTINGS,
            rig,
            world,
            recorded,  # type: ignore[arg-type]
            supervision=supervision,
            zero_first=True,
            state_changed=sink.state_changed,
            watch=lambda loop: (world.watch(loop), sink.watch(loop)),
        )
    memory.close()
    time_s, sent, angle_rad = np.array(rows).T
    after = time_s >= at_s
    moving = np.flatnonzero(after & (sent != 0.0))
    zero = int(moving[-1]) + 1 if moving.size else int(np.argmax(after))
    zero = min(zero, len(time_s) - 1)
    settled = time_s >= time_s[zero] + 2.0 * SETTINGS.guard.reaction_time_s
    still = angle_rad[settled]
    motion_deg = float(np.rad2deg(np.ptp(still))) if still.size else 0.0
    zero_s = max(float(time_s[zero]) - at_s, 0.0)
    return Closed(
        *(how, phase, at_s, zero_s, motion_deg, float(time_s[-1]) - at_s),
        *(world.phase, result.reason),
    )


def moments(count: int = 20, seed: int = 1) -> list[tuple[str, float]]:
    """Return random moments, as many in each phase."""
    rng = np.random.default_rng(seed)
    phases = [PHASES[k % len(PHASES)] for k in range(count)]
    return [(phase, float(rng.uniform(*SPANS_S[phase]))) for phase in phases]


def pause_table(cases: list[Closed]) -> str:
    """Return the table of the slowest case of each phase and each way to go."""
    lines = [
        "| Gone | While | Moments | Zero sent after | Motion after that | Session ends after |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for how in HOW:
        for phase in PHASES:
            some = [case for case in cases if (case.how, case.phase) == (how, phase)]
            zero_ms = 1e3 * max(case.zero_s for case in some)
            motion_deg, end_s = (max(getattr(c, n) for c in some) for n in ("motion_deg", "end_s"))
            lines.append(
                f"| {how} | {phase} | {len(some)} | {zero_ms:.0f} ms | {motion_deg:.2f} deg | "
                f"{end_s:.1f} s |"
            )
    return "\n".join(lines)
