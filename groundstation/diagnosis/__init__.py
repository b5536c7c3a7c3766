"""Says in flight which figure of the field is wrong, if any."""
