"""What the operator sees and says while the rig runs."""

from rigidimeter.console.facts import Facts, facts
from rigidimeter.console.lamps import Level, RecorderState
from rigidimeter.console.next_steps import new_folder, next_steps, resume_command
from rigidimeter.console.observer import Observer
from rigidimeter.console.session_plan import SessionPlan
from rigidimeter.console.terminal import terminal_view
from rigidimeter.console.tty import discard_typed
