"""One run: which processes it consists of, its folder, and the flight from start to landing."""
