"""Bags of ROS: the pairs of a stereo camera in one, and the odometry beside them."""
