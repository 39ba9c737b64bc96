"""The processes around the loop, the memory they share, and what they ask of the machine."""

from rigidimeter.rig.acquisition.processes.emg_process import emg_main
from rigidimeter.rig.acquisition.processes.end_signals import (
    HELD_BACK,
    held_back,
    leave_to_the_others,
    raise_flags,
    signals_are_orders,
)
from rigidimeter.rig.acquisition.processes.live_estimate import Estimator
from rigidimeter.rig.acquisition.processes.lone_supervision import LoneSupervision
from rigidimeter.rig.acquisition.processes.loop_process import LoopSide, Realtime
from rigidimeter.rig.acquisition.processes.lsl_streams import streamer_main
from rigidimeter.rig.acquisition.processes.orphaned_memory import complete_left
from rigidimeter.rig.acquisition.processes.realtime_scheduling import Prepared, prepare_loop_process
from rigidimeter.rig.acquisition.processes.recorder import Patience, Recorder, RecordingPlan
from rigidimeter.rig.acquisition.processes.ring import ROW, EventRing, SampleReader, SampleRing
from rigidimeter.rig.acquisition.processes.ring_recovery import recover_from_rings
from rigidimeter.rig.acquisition.processes.ring_writer import RingSink, SharedSupervision
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.shared_memory import PREFIX, WHERE, Memory
from rigidimeter.rig.acquisition.processes.shared_status import NOTE_BYTES, SharedStatus
from rigidimeter.rig.acquisition.processes.status_values import (
    PAUSE_NEXT,
    STOP_NEXT,
    Flag,
    LiveEstimate,
    LoopStatus,
    ProcessCondition,
    Role,
)
from rigidimeter.rig.acquisition.processes.supervisor import Ended, EndedEarly, supervise
from rigidimeter.rig.acquisition.processes.watchdog import WatchedProcess
