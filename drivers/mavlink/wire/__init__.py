"""MAVLink 2 frames and the messages we know, as values; pymavlink's dialect is the codec."""
