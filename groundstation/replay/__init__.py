"""Replays recordings: in the console as they were, and through today's tracker to see differences."""
