"""Who may observe whom (topologies) and the information that the planner expects of each sensor."""
