"""Flights of a lab whose field file is wrong: what the operator is told before the take-off and after."""
