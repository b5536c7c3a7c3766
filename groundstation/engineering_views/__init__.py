"""Optional views for engineers: Rerun and Foxglove, live or from a recording."""
