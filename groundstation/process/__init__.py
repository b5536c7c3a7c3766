"""Common parts of all child processes: heartbeat, parent watch, signals, log, and the `Child` that bundles them."""
