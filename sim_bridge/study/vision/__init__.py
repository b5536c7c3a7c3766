"""The bench of markers and detector: rendered pictures in, detection rates, errors, honesty and cost out."""
