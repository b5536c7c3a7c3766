"""Processes that are neither drivers nor the supervisor (tracker, router, recorder, monitor), and the operator."""
