"""Flights of a lab whose field file is wrong, and what `calibrate team` makes of them."""
