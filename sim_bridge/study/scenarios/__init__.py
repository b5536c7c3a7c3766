"""Scenarios flown at message level: drivers, watchdogs and tracker as they fly, judged by what each file expects."""
