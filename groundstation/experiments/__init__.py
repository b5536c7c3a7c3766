"""The paper's planar simulation: point robots, a global sensor at the origin, a target to be tracked."""
