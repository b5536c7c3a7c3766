"""What a recorded run was worth: figures, criteria, a plot and a summary."""
