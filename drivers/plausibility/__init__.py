"""Whether what a vehicle says of its motion can be true: health per sensor, from values and their times. Pure."""
