"""The simulated room: bodies that move by seeded dynamics in fixed steps."""
