"""One run: its processes, its folder, and the flight from start to landing."""
