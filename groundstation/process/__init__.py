"""What every child process shares: heartbeat, parent watch, signals, log, and the `Child` that bundles them."""
