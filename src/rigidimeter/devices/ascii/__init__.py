"""Servos of the Copley kind that speak ASCII on a serial line."""
