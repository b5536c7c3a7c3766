"""The process table of a run: start, watch, restart and stop; and the runtime file that tells others of it."""
