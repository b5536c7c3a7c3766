"""A target's own odometry, received by a client of its ROS 2 router."""
