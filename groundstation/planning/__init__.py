"""Chooses the sensing topology and velocities that minimise the target's expected position uncertainty."""
