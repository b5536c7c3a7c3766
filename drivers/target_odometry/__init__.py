"""A target's own odometry, heard as a client of its ROS 2 router."""
