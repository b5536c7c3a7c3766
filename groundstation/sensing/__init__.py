"""Who may observe whom (topologies) and what the planner believes each sensor delivers."""
