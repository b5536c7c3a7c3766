"""Markers on paper: vector pages of exact scale."""
