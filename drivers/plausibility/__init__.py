"""Judges whether a vehicle's reported motion can be true: health per sensor, from values and their times. Pure."""
