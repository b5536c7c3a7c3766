"""Scenarios flown at message level by the real drivers, watchdogs and tracker, judged by each file's expectations."""
