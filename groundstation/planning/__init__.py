"""Picks the sensing topology and the velocities that minimise the expected uncertainty of the target."""
