"""Recordings come alive again: through the console as it was, and through today's tracker to see what differs."""
