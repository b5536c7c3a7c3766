"""Ranging systems: radios that measure a robot's distances to anchors at surveyed places."""
