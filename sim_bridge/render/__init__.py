"""Renders what each emulated camera sees: floor, bodies and boards, with honest errors."""
