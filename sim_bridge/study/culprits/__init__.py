"""Flights of a lab whose field file is wrong, with all notices to the operator before and after take-off."""
