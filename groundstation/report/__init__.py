"""The evaluation of a recorded run: figures, criteria, a plot and a summary."""
