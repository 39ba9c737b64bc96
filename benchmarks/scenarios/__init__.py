"""Estimates and checks on recordings of a simulator that the estimation knows nothing of."""
