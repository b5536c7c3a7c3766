"""MCAP recordings of a run: schemas, files that survive a crash, and a reader that recovers damaged ones."""
