"""Finds wrong figures of the field in flight."""
