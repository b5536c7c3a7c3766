"""Radios that tell how far a robot is from anchors at surveyed places."""
