"""Healthy missions in random rooms with random targets, judged until all drones stand again."""
