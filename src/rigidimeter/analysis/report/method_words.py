"""The methods and their intervals in words."""

from __future__ import annotations

from rigidimeter.analysis.estimation import METHODS, Method


def method_of(name: str) -> Method | None:
    """Return the estimator of that name; None for one of a file that is not known here."""
    return next((method for method in METHODS if method.name == name), None)


def method_title(name: str) -> str:
    """Return what a method does, or its name where it is not known."""
    method = method_of(name)
    return name if method is None else method.title


def interval_basis(name: str) -> str:
    """Return what the intervals of a method hold for."""
    method = method_of(name)
    return "" if method is None else method.intervals_text


def pooled_basis(name: str) -> str:
    """Return what the intervals of all epochs together hold for."""
    method = method_of(name)
    return "" if method is None else method.pooled_text


def is_least_squares(name: str) -> bool:
    """Return whether voluntary torque biases a method: it does not use the perturbation."""
    method = method_of(name)
    return method is not None and not method.uses_perturbation
