"""Planners of others to compare ours with: no topology, random samples, a lattice, and the method's first program."""
