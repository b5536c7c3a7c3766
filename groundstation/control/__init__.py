"""From a plan to each robot's setpoint: setpoints, the search after a loss, and the output limiter."""
