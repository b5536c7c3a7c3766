"""MCAP recordings of a run: schemas, files that survive a crash, and a reader that takes what is left of them."""
