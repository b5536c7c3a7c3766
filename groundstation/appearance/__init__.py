"""The appearance of a team: one colour for each robot and target, one form of a topology, one unit of cost."""
