"""The operator's page: a server in the console's process, and what the page sends and shows."""

from rigidimeter.rig.console.page.access import (
    LONGEST_BODY,
    MAX_MESSAGES,
    AccessCheck,
    cookie_name,
    in_url,
    is_loopback,
    same_origin,
    slow_enough,
)
from rigidimeter.rig.console.page.after_view import AfterView
from rigidimeter.rig.console.page.before_view import BeforeView, protocol_names, read_protocol
from rigidimeter.rig.console.page.button_words import in_buttons, next_buttons, unfinished_words
from rigidimeter.rig.console.page.draw_view import DrawView
from rigidimeter.rig.console.page.form_values import (
    parse_integer,
    parse_line,
    parse_name,
    parse_number,
)
from rigidimeter.rig.console.page.jobs import QUESTION, CommandResult, Jobs
from rigidimeter.rig.console.page.live_socket import LiveSockets, OpenPage
from rigidimeter.rig.console.page.outside_plan import OutsideView
from rigidimeter.rig.console.page.page_messages import (
    LEVELS,
    LONGEST_TEXT,
    ORDERS,
    RefusedMessage,
    parse_message,
    points,
    session_state,
)
from rigidimeter.rig.console.page.page_token import new_token, require_token, token_in
from rigidimeter.rig.console.page.plan_form import empty_plan_form, read_plan_form
from rigidimeter.rig.console.page.plan_view import PlanView
from rigidimeter.rig.console.page.prediction import detected, dry_run_lines, prediction_lines
from rigidimeter.rig.console.page.recorded_traces import amplitude_densities, as_json, epoch_panes
from rigidimeter.rig.console.page.rig_steps import RigStep, start_refusal
from rigidimeter.rig.console.page.server import PageServer
from rigidimeter.rig.console.page.server_state import (
    AWAY_S,
    SETTLES_S,
    SILENT_S,
    Place,
    Presence,
    RunningSession,
    ServerState,
    StartRequest,
)
from rigidimeter.rig.console.page.session_form import empty_form, read_form, restored_form
from rigidimeter.rig.console.page.sessions_found import (
    FoundSession,
    exclude,
    extended,
    found_sessions,
    include,
    report_file,
    report_folder,
    report_link,
)
