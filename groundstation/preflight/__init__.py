"""Checks before a take-off: links, cameras, and each drone's place on its pad."""
