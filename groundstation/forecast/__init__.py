"""Forecast of tracking in a field before a flight: accuracy, blind places, and the cost of failures."""
