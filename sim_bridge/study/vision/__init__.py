"""The bench of markers and detector: rendered pictures in, detection rates, errors, consistency and cost out."""
