"""An emulated serial servo drive on a pseudo-terminal: ASCII registers and trapezoid moves.

Replies take as long as on a real serial line: ten bits a character at the baud rate, each way, plus
a processing delay. The drive starts at 9600 baud, changes by ``s r0x90``, and receives only noise
while the host's port is set to another rate. A pseudo-terminal carries no break, so the drive keeps
its rate from one host to the next. The trajectory generator runs absolute and relative trapezoids
with its own deceleration whether or not the host is still there; a position loop moves the arm.

A relative move that starts during another is added to the previous target. Manuals can be read in
two ways here; this is the more dangerous one.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import termios
import threading
import time
import tty
from collections import deque
from typing import Any

from rigidimeter.testing.emulated_arm import EmulatedArm
from rigidimeter.testing.trapezoid import Ramps, Trapezoid

ASCII_MISBEHAVIOURS = {
    "silent": "sends no replies",
    "error_replies": "refuses every request with this code",
    "garbage": "replies with characters that are not a reply",
    "damaged_register": "replies to requests about this register with characters that are no reply",
    "status_is": "reports this event status",
    "half_replies": "stops in the middle of each reply",
    "slow_replies": "replies this many seconds late",
    "wrong_baud": "changes to this baud rate by itself",
    "fault": "latches the fault with this bit and takes the power away",
    "power_lost": "the hardware enable opens",
    "does_not_follow": "accepts commands and does not move",
    "runs_away": "moves at this velocity in rad/s whatever is commanded",
    "encoder_frozen": "keeps reporting the present position and velocity",
    "encoder_jump": "adds this many counts to the position",
    "encoder_sign_flip": "reports position and velocity with the opposite sign",
    "velocity_gain": "reports so many times the velocity, such as 0 or -1",
    "stale_target": "keeps this target velocity in 0.1 counts/s, whatever is written",
    "bound_sleeps": "takes this register of a bound and does not obey it",
    "no_register": "has no register of this number",
    "changes_state": "changes to this desired state by itself",
}
"""What `AsciiEmulator.misbehave` can do."""

OFF, VELOCITY, MOVES = 0, 11, 21
POWER_UP_BAUD = 9600
THINKING_S = 0.0002
"""From the end of a request to the start of its reply."""

PEAK_CURRENT, VELOCITY_LIMIT, POSITIVE_LIMIT, NEGATIVE_LIMIT = 0x21, 0x3A, 0xB8, 0xB9
"""Registers of bounds; those of the position act in moves, and not where both are the same."""

HIGHEST = 2**31 - 1
STEP_S = 0.001
GENERATOR_STEP_S = 0.0005
LOOP_GAIN_S = 60.0
SPEEDS = {getattr(termios, f"B{rate}"): rate for rate in (9600, 19200, 38400, 57600, 115200)}
FAULT, ENABLE_OPEN, DISABLED, NO_PWM, MOVING = 1 << 22, 1 << 11, 1 << 12, 1 << 15, 1 << 27
TEXTS = {0x92: "EMU-055-18", 0x81: "4711"}
READ_ONLY = (0x0C, 0x18, 0x22, 0x32, 0xA0)
NM_PER_A = 1.0
"""Torque at the joint, by the drive's own scale, for an ampere of its motor."""


class AsciiEmulator:
    """The drive's end of the serial line; a thread replies until `close`.

    Parameters
    ----------
    arm : EmulatedArm
    counts_per_turn : float
        Encoder counts for one turn of the joint.
    """

    def __init__(
        self,
        arm: EmulatedArm,
        *,
        counts_per_turn: float = 360_000.0,
    ) -> None:
        self._arm = arm
        self._per_rad = counts_per_turn / (2.0 * math.pi)
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)
        self.log: deque[tuple[float, str, str]] = deque(maxlen=100_000)
        self._faults: dict[str, Any] = {}
        self._registers = {0x24: OFF, 0x2F: 0, 0x36: 1000, 0x37: 1000, 0x90: POWER_UP_BAUD}
        self._registers |= dict.fromkeys((0xA4, 0xC8, 0xCA, 0xCB), 0)
        self._registers[0x22] = round(100.0 * arm.drive_side.rated_torque_nm / NM_PER_A)
        self._registers |= dict.fromkeys((0xCC, 0xCD, 0xCF), 10_000)
        self._registers |= {PEAK_CURRENT: HIGHEST, VELOCITY_LIMIT: HIGHEST}
        self._registers |= {POSITIVE_LIMIT: 0, NEGATIVE_LIMIT: 0}
        position = self._counts()[0]
        self._generator = Trapezoid(position, position)
        self._generated_s = time.monotonic()
        self._frozen: tuple[int, int] | None = None
        self._running = True
        self._lock = threading.RLock()
        self._thread = threading.Thread(target=self._run, name="ascii-emulator", daemon=True)
        self._thread.start()

    # -- for tests and operators ----------------------------------------------------------------

    def misbehave(self, name: str, value: float = 1) -> None:
        """Start a misbehaviour of `ASCII_MISBEHAVIOURS`."""
        if name not in ASCII_MISBEHAVIOURS:
            raise ValueError(f"misbehaviour is {name!r}; one of {', '.join(ASCII_MISBEHAVIOURS)}")
        with self._lock:
            if name == "fault":
                self._registers[0xA4] |= 1 << int(value)
                self._generator.speed = 0.0
            elif name == "encoder_frozen":
                self._frozen = self._seen()
            elif name == "changes_state":
                self._registers[0x24] = int(value)
            elif name == "wrong_baud":
                self._registers[0x90] = int(value)
            elif name == "stale_target":
                self._registers[0x2F] = int(value)
            self._faults[name] = value

    def behave(self) -> None:
        """End every misbehaviour; a latched fault stays until it is cleared."""
        with self._lock:
            self._faults.clear()
            self._frozen = None

    def state(self) -> dict[str, float | int | bool]:
        """Return the true state of the drive and the arm."""
        with self._lock:
            angle_rad, velocity_rad_s = self._arm.motion()
            return {
                "angle_rad": angle_rad,
                "velocity_rad_s": velocity_rad_s,
                "power": self._powered(),
                "desired_state": self._registers[0x24],
                "target_rad_s": self._wanted() / self._per_rad,
                "status": self._status(),
                "baud": self._registers[0x90],
                "requests": len(self.log),
            }

    def close(self) -> None:
        """End the thread and close both ends of the pseudo-terminal."""
        if not self._running:
            return
        self._running = False
        self._thread.join()
        self._arm.release()
        os.close(self._master)
        os.close(self._slave)

    # -- serial line --------------------------------------------------------------------------

    def _run(self) -> None:
        received = bytearray()
        arrived_s = 0.0
        while self._running:
            ready, _, _ = select.select([self._master], [], [], STEP_S)
            with self._lock:
                self._generate()
            if not ready:
                continue
            chunk = os.read(self._master, 4096)
            if not received:
                arrived_s = time.monotonic()
            rate = SPEEDS.get(termios.tcgetattr(self._slave)[4])
            if rate != self._registers[0x90]:
                self.log.append((time.monotonic(), "(noise)", ""))
                received.clear()
                continue
            received += chunk
            while b"\r" in received:
                line, _, rest = bytes(received).partition(b"\r")
                received = bytearray(rest)
                arrived_s += (len(line) + 1) * self._character_s()
                self._until(arrived_s + THINKING_S)
                self._answer(line.decode("ascii", "replace").strip(), arrived_s + THINKING_S)
                arrived_s = time.monotonic()

    def _answer(self, request: str, begun_s: float) -> None:
        character_s = self._character_s()
        with self._lock:
            faults = dict(self._faults)
            reply = self._reply(request)
            self.log.append((time.monotonic(), request, reply))
        if "silent" in faults:
            return
        if "garbage" in faults or _register_of(request) == faults.get("damaged_register", -1):
            reply = "\x7f#?"
        data = reply.encode("ascii") + b"\r"
        if "half_replies" in faults:
            data = data[: len(data) // 2]
        self._until(begun_s + len(data) * character_s + float(faults.get("slow_replies", 0.0)))
        # Nobody reads when the host is gone, and the buffer fills. A real drive would not notice.
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)

    def _character_s(self) -> float:
        return 10.0 / self._registers[0x90]

    def _until(self, at_s: float) -> None:
        while self._running and (left_s := at_s - time.monotonic()) > 0.0:
            time.sleep(min(left_s, STEP_S))
            with self._lock:
                self._generate()

    def _reply(self, request: str) -> str:
        if "error_replies" in self._faults:
            return f"e {int(self._faults['error_replies'])}"
        match request.split():
            case ["g", name] if (register := _register(name)) is not None:
                return self._read(register)
            case ["s", name, number] if (register := _register(name)) is not None:
                return self._write(register, number)
            case ["t", "0"]:
                self._generator.aborting = True
                return "ok"
            case ["t", "1"]:
                return self._start_move()
        return "e 1"

    def _read(self, register: int) -> str:
        if self._faults.get("no_register") == register:
            return "e 15"
        if register in TEXTS:
            return f"v {TEXTS[register]}"
        position, velocity = self._seen()
        status = self._faults.get("status_is", self._status())
        live = {0x32: position, 0x18: velocity, 0xA0: status}
        if register == 0x0C:
            torque_nm = self._arm.drive_torque_nm() if self._powered() else 0.0
            live[register] = round(100.0 * torque_nm / NM_PER_A)
        value = live.get(register, self._registers.get(register))
        return "e 15" if value is None else f"v {value}"

    def _write(self, register: int, number: str) -> str:
        try:
            value = int(number, 0)
        except ValueError:
            return "e 33"
        lacking = self._faults.get("no_register") == register
        if register not in self._registers or register in READ_ONLY or lacking:
            return "e 15"
        if register == 0x90 and value not in SPEEDS.values():
            return "e 33"
        if register == 0x2F and "stale_target" in self._faults:
            return "ok"
        if register == 0xA4:
            value = self._registers[0xA4] & ~value
        if register == 0x24 and value != self._registers[0x24]:
            # The generator restarts at rest where the arm is.
            self._generator.rest(self._counts()[0])
        self._registers[register] = value
        return "ok"

    # -- the drive ----------------------------------------------------------------------------

    def _counts(self) -> tuple[float, float]:
        angle_rad, velocity_rad_s = self._arm.motion()
        return angle_rad * self._per_rad, velocity_rad_s * self._per_rad

    def _seen(self) -> tuple[int, int]:
        if self._frozen is not None:
            return self._frozen
        position, velocity = self._counts()
        if "encoder_sign_flip" in self._faults:
            position, velocity = -position, -velocity
        position += float(self._faults.get("encoder_jump", 0.0))
        velocity *= float(self._faults.get("velocity_gain", 1.0))
        return round(position), round(10.0 * velocity)

    def _powered(self) -> bool:
        state = self._registers[0x24]
        return (
            state in (VELOCITY, MOVES)
            and not self._registers[0xA4]
            and "power_lost" not in self._faults
        )

    def _status(self) -> int:
        status = self._registers[0xA4]
        if status:
            status |= FAULT
        if self._registers[0x24] == OFF:
            status |= DISABLED
        if "power_lost" in self._faults:
            status |= ENABLE_OPEN
        if not self._powered():
            status |= NO_PWM
        elif self._generator.speed != 0.0:
            status |= MOVING
        return status

    def _start_move(self) -> str:
        if not self._powered() or self._registers[0x24] != MOVES:
            return "e 22"
        generator, target = self._generator, float(self._registers[0xCA])
        if self._registers[0xC8] == 256:
            target += generator.position if generator.aborting else generator.target
        elif self._registers[0xC8] != 0:
            return "e 22"
        lowest, highest = self._position_limits()
        target = max(lowest, min(highest, target))
        generator.move(target, 0.1 * min(self._registers[0xCB], self._bound(VELOCITY_LIMIT)))
        return "ok"

    def _bound(self, register: int) -> int:
        """Return what a register bounds; the highest value where it sleeps."""
        asleep = self._faults.get("bound_sleeps") == register
        return HIGHEST if asleep else self._registers[register]

    def _position_limits(self) -> tuple[float, float]:
        lowest, highest = self._registers[NEGATIVE_LIMIT], self._registers[POSITIVE_LIMIT]
        asleep = self._faults.get("bound_sleeps") in (POSITIVE_LIMIT, NEGATIVE_LIMIT)
        return (lowest, highest) if lowest < highest and not asleep else (-math.inf, math.inf)

    def _wanted(self) -> float:
        """Return the target velocity in counts/s."""
        if not self._powered():
            return 0.0
        if self._registers[0x24] == VELOCITY:
            return self._velocity()
        return self._generator.wanted(self._ramps())

    def _velocity(self) -> float:
        """Return the programmed velocity within its limit, in counts/s."""
        limit = self._bound(VELOCITY_LIMIT)
        return 0.1 * max(-limit, min(limit, self._registers[0x2F]))

    def _ramps(self) -> Ramps:
        if self._registers[0x24] == VELOCITY:
            return Ramps(1000.0 * self._registers[0x36], 1000.0 * self._registers[0x37])
        down = self._registers[0xCF if self._generator.aborting else 0xCD]
        return Ramps(10.0 * self._registers[0xCC], 10.0 * down)

    def _generate(self) -> None:
        """Advance the generator to the present time and make the arm follow it."""
        now_s = time.monotonic()
        current = self._bound(PEAK_CURRENT)
        bounded = current < HIGHEST and self._powered()
        self._arm.torque_limit_nm = 0.01 * current * NM_PER_A if bounded else math.inf
        while self._generated_s < now_s:
            step_s = min(GENERATOR_STEP_S, now_s - self._generated_s)
            self._generated_s += step_s
            self._step(step_s)
        if "runs_away" in self._faults and self._powered():
            self._arm.command(float(self._faults["runs_away"]))
        elif not self._powered() or "does_not_follow" in self._faults:
            self._arm.command(0.0)
        else:
            generator, moves = self._generator, self._registers[0x24] == MOVES
            error = generator.position - self._counts()[0] if moves else 0.0
            self._arm.command((generator.speed + LOOP_GAIN_S * error) / self._per_rad)

    def _step(self, step_s: float) -> None:
        generator = self._generator
        if not self._powered():
            # The target of the last move is kept, as in a real drive.
            generator.position, generator.speed = self._counts()[0], 0.0
        elif self._registers[0x24] == VELOCITY:
            generator.run(self._velocity(), self._ramps(), step_s)
        else:
            generator.step(self._ramps(), step_s)


def _register_of(request: str) -> int | None:
    parts = request.split()
    return _register(parts[1]) if len(parts) > 1 else None


def _register(name: str) -> int | None:
    try:
        return int(name[1:], 16) if name.startswith("r0x") else None
    except ValueError:
        return None
