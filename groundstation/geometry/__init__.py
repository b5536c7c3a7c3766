"""Angles, rotations, poses, lens model and marker layout; pure functions on numpy arrays."""
