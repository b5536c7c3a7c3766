"""Motion capture: poses of named bodies from a system fixed in the world."""
