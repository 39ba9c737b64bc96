"""What the operator sees and says while the rig runs."""

from rigidimeter.console.facts import ConditionCount, EpochFacts, Facts, facts
from rigidimeter.console.lamps import Lamp, Level, RecorderState
from rigidimeter.console.limit_distances import LimitDistance
from rigidimeter.console.live_values import LiveValue
from rigidimeter.console.next_steps import new_folder, next_steps, resume_command
from rigidimeter.console.observer import Observer
from rigidimeter.console.orders import KEYS
from rigidimeter.console.session_plan import SessionPlan
from rigidimeter.console.session_progress import EndedEpoch, Progress
from rigidimeter.console.terminal import terminal_view
from rigidimeter.console.trace_reader import TraceReader, Traces
from rigidimeter.console.tty import discard_typed

__all__ = [
    "KEYS",
    "ConditionCount",
    "EndedEpoch",
    "EpochFacts",
    "Facts",
    "Lamp",
    "Level",
    "LimitDistance",
    "LiveValue",
    "Observer",
    "Progress",
    "RecorderState",
    "SessionPlan",
    "TraceReader",
    "Traces",
    "discard_typed",
    "facts",
    "new_folder",
    "next_steps",
    "resume_command",
    "terminal_view",
]
