"""The process table of a run: start, watch, restart and stop; and the runtime file by which others find it."""
