"""Messages, keys and tokens of ROS 2 over Zenoh: bytes in, values out."""
