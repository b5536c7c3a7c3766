"""The planar planner as others would write it: oracles for the tests, denominators for the benchmark."""
