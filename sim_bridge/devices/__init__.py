"""Emulated hardware at the other end of a driver's link."""
