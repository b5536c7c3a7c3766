"""Measuring cameras: their lens from pictures of a board, their place from markers at known places."""
