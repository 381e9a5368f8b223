"""A robot that runs ROS 2: met on Zenoh as its middleware rmw_zenoh speaks there."""
