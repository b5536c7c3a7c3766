"""The estimator on real data: the UTIAS multi-robot localisation and mapping sets (MRCLAM)."""
