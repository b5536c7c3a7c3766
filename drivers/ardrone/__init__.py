"""Driver for Parrot AR.Drone 1 and 2 over their UDP protocol."""
