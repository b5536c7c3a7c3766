"""The planar planner as others would write it: oracles for the tests, references for the benchmark."""
