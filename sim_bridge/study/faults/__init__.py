"""The fault campaign: tracker, drivers and watchdogs as they fly, in a simulated world where things go wrong."""
