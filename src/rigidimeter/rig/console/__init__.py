"""What the operator sees and says while the rig runs."""

from rigidimeter.rig.console.after_session import next_steps, resume_command
from rigidimeter.rig.console.alarms import Alarm, Alarms
from rigidimeter.rig.console.emg_state import EmgState, EnvelopeReader
from rigidimeter.rig.console.indicators import (
    Level,
    RecentSamples,
    RecorderState,
    all_indicators,
    limit_distances,
    recent_samples,
)
from rigidimeter.rig.console.line_view import BELL, LineView, status_line
from rigidimeter.rig.console.live_parameters import LiveValue, caution, live_values, settling_s
from rigidimeter.rig.console.observer import Observer
from rigidimeter.rig.console.orders import KEYS, order_of, save_to
from rigidimeter.rig.console.session_facts import Facts, facts
from rigidimeter.rig.console.session_progress import (
    Progress,
    SessionPlan,
    progress_after,
    progress_at_start,
)
from rigidimeter.rig.console.stop_keys import KEYS_HERE, NO_KEYS, StopKeys, stop_keys
from rigidimeter.rig.console.terminal import (
    BEAT,
    BEAT_S,
    LEAVE,
    QUESTION,
    KeyView,
    Tty,
    discard_typed,
    terminal_view,
)
from rigidimeter.rig.console.trace_reader import AT_ONCE, TRACES, BandTorque, TraceReader, Traces
