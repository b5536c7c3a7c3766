"""The Tello's text protocol: bytes in, values out."""
