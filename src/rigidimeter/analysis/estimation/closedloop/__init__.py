"""Estimates from a known perturbation in a closed loop, where the motion itself is not trusted."""
