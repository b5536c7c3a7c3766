"""Planner for point robots in the plane: the method's own setting, with exact gradients and certified pruning."""
