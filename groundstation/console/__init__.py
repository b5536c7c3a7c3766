"""The operator's web page and its server: one process, one WebSocket per viewer, loopback only."""
