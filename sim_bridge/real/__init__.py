"""Real bodies in the emulated room: where they are, from whom that is known."""
