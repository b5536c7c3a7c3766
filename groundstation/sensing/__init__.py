"""Sensing topologies (who may observe whom), and the information that the planner expects of each sensor."""
