"""Flights of a lab whose field file is wrong, and the result of `calibrate team` on them."""
