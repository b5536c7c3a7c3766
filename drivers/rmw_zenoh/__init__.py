"""ROS 2 over its own Zenoh router, shared by several kinds of drivers: messages, keys, and a client of the router."""
