"""Skein: a ground station with which small teams of drones track a moving ground target together."""

__version__ = "0.1.0"
