"""Recordings and whole studies of a subject that does not exist, made on the virtual rig."""
