"""What the operator sees and says while the rig runs."""

from rigidimeter.rig.console.band_torque import BandTorque
from rigidimeter.rig.console.facts import ConditionCount, Facts, facts
from rigidimeter.rig.console.key_view import KeyView
from rigidimeter.rig.console.lamps import Level, RecorderState, lamps
from rigidimeter.rig.console.limit_distances import LimitDistance, limit_distances
from rigidimeter.rig.console.line_view import LineView, status_line
from rigidimeter.rig.console.live_values import LiveValue, caution, live_values, settling_s
from rigidimeter.rig.console.next_steps import new_folder, next_steps, resume_command
from rigidimeter.rig.console.observer import Observer
from rigidimeter.rig.console.orders import KEYS, order_of, save_to
from rigidimeter.rig.console.recent_samples import RecentSamples, recent_samples
from rigidimeter.rig.console.session_plan import SessionPlan
from rigidimeter.rig.console.session_progress import Progress, progress_after, progress_at_start
from rigidimeter.rig.console.terminal import QUESTION, terminal_view
from rigidimeter.rig.console.trace_reader import AT_ONCE, TRACES, TraceReader, Traces
from rigidimeter.rig.console.tty import LEAVE, Tty, discard_typed
