"""ROS 2 over its own Zenoh router, as kinds of drivers share it: messages, keys, and a client of the router."""
