"""A flight for ROS 2 tools, without ROS: messages, bags, and a bridge to a ROS 2 Zenoh router. Extra [ros2]."""

from pathlib import Path

LAYOUTS = Path(__file__).with_name("layouts")
"""Folder of the layouts for RViz and Foxglove."""
