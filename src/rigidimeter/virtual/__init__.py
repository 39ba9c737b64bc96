"""Recordings and whole studies of a subject that does not exist, made on the virtual rig."""

from rigidimeter.virtual.virtual_session import run_virtual_session, simulate
