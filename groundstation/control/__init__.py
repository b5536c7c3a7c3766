"""From a plan to what each robot is told: setpoints, the search after a loss, and the output limiter."""
