"""Whole flights at message level: world, noise and the tracker under a manual clock, faster than real time."""
