"""A flight for ROS 2 tools, without ROS: messages, bags, and a bridge to a ROS 2 Zenoh router. Extra [ros2]."""
