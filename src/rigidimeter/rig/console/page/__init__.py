"""The operator's page: a server in the console's process, and what the page sends and shows."""

from rigidimeter.rig.console.page.after_view import AfterView
from rigidimeter.rig.console.page.button_words import in_buttons, next_buttons, unfinished_words
from rigidimeter.rig.console.page.desk import Desk, Place, RunningSession, StartRequest
from rigidimeter.rig.console.page.entered import line, name, number, whole_number
from rigidimeter.rig.console.page.gate import (
    LONGEST_BODY,
    MOST_MESSAGES,
    Gate,
    cookie_name,
    host_allowed,
    is_loopback,
    same_origin,
    slow_enough,
)
from rigidimeter.rig.console.page.kept_study import extended
from rigidimeter.rig.console.page.live_socket import LiveSockets, OpenPage
from rigidimeter.rig.console.page.page_messages import (
    LONGEST_TEXT,
    ORDERS,
    RefusedMessage,
    parse_message,
)
from rigidimeter.rig.console.page.prediction import dry_run_lines, prediction_lines
from rigidimeter.rig.console.page.presence import AWAY_S, SILENT_S, Presence
from rigidimeter.rig.console.page.protocols import protocol_names, read_protocol
from rigidimeter.rig.console.page.recorded_traces import amplitude_densities, as_json, epoch_traces
from rigidimeter.rig.console.page.report_files import report_file, report_folder, report_link
from rigidimeter.rig.console.page.rig_steps import RigStep, refusal
from rigidimeter.rig.console.page.server import PageServer
from rigidimeter.rig.console.page.session_form import empty_form, kept_form, read_form
from rigidimeter.rig.console.page.session_state import LEVELS, points, session_state
from rigidimeter.rig.console.page.sessions_found import FoundSession, exclude, found_sessions
from rigidimeter.rig.console.page.work import QUESTION, Answer, Work
