"""Bytes of motion capture systems."""
