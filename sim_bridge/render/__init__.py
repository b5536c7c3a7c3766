"""Renders the pictures of emulated cameras: floor, bodies and boards, with realistic errors."""
