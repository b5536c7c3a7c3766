"""Checks whether this machine meets the requirements of a flight, with remedies."""
