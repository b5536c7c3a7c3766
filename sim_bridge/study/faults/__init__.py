"""The fault campaign: the real tracker, drivers and watchdogs, in a simulated world with faults."""
