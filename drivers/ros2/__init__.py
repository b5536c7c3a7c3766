"""Vehicles behind a ROS 2 node: Odometry in, Twist out."""
