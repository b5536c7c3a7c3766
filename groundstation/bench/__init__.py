"""Benchmarks: CPU time, latency and ratios to named peers; nothing here flies."""
