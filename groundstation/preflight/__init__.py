"""Checks before a take-off: links, cameras, and where each drone stands."""
