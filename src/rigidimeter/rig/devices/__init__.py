"""Torque sensors, drives and rigs, behind the protocols of `base`."""

from rigidimeter.rig.devices.ascii.drive import AsciiDrive
from rigidimeter.rig.devices.ascii.language import (
    Feedback,
    line_time_s,
    move_target,
    parse,
    read_request,
    set_request,
)
from rigidimeter.rig.devices.ascii.line import AsciiLine, Exchange
from rigidimeter.rig.devices.ascii.setup import PATIENCE
from rigidimeter.rig.devices.ati.analogue import AtiAnalogue, ReaderError
from rigidimeter.rig.devices.ati.calibration import (
    AXES,
    FORCE_UNITS_N,
    TORQUE_UNITS_NM,
    read_calibration,
)
from rigidimeter.rig.devices.ati.rdt import AtiRdt
from rigidimeter.rig.devices.ati.rdt_packets import (
    COUNTS,
    START_REALTIME,
    STOP,
    RdtStream,
    request,
    status_words,
)
from rigidimeter.rig.devices.ati.rdt_setup import page_changes, parse_page
from rigidimeter.rig.devices.ati.sample_clock import LONGEST_DELAY_S, SampleClock
from rigidimeter.rig.devices.bounds import (
    BOUND_FACT,
    LOST,
    MOTOR_SPEED,
    POSITION,
    SLIPPAGE,
    SPEED,
    TORQUE,
    TORQUE_MARGIN,
    BoundFound,
    DriveBounds,
    Tight,
    drive_bounds,
)
from rigidimeter.rig.devices.cia402.drive import Cia402Drive
from rigidimeter.rig.devices.cia402.drive_bounds import (
    DriveSays,
    bound_objects,
    wanted_bounds,
    write_bounds,
)
from rigidimeter.rig.devices.cia402.drive_objects import DriveObject, drive_objects
from rigidimeter.rig.devices.cia402.eds import compare_eds
from rigidimeter.rig.devices.cia402.sdo_transfers import read_back, write_object
from rigidimeter.rig.devices.cia402.setup import (
    Cia402Settings,
    Object,
    displayed_mode,
    objects,
    scale,
)
from rigidimeter.rig.devices.cia402.state_words import (
    NEXT_CONTROL,
    OPERATIONAL,
    PRE_OPERATIONAL,
    STOPPED,
    Cia402State,
    Control,
    command_bytes,
    emergency,
    fastest_tick_rate_hz,
    frame_bits,
    frames,
    inputs_of,
    position_of,
    sdo_answer,
    sdo_read_bytes,
    sdo_write_bytes,
    state_of,
    velocity_of,
    velocity_torque_of,
)
from rigidimeter.rig.devices.composed import ComposedRig, Home
from rigidimeter.rig.devices.emg_sources import DaqEmg, open_emg, require_emg
from rigidimeter.rig.devices.enable_line import SerialEnableLine
from rigidimeter.rig.devices.motion_range import (
    LEAST_DEG,
    LED,
    STOP_HIGH,
    STOP_LOW,
    STOP_MARGIN_DEG,
    TYPED,
    MotionRange,
    range_of,
    require_within,
)
from rigidimeter.rig.devices.rig_lock import RigLock, lock_path
from rigidimeter.rig.devices.rigfile import DRIVERS, RigFile, load_rig
from rigidimeter.rig.devices.simulated import SimulatedRig
