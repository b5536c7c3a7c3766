"""Emulated hardware: what a driver finds at the other end of the wire."""
