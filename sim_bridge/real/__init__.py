"""Real bodies in the emulated room, and the sources of their poses."""
