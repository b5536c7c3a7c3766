"""Calibration from recorded flights: delays of sensors, mountings of cameras."""
