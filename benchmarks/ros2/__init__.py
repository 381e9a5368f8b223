"""How soon and how wholly messages pass between a robot of ROS 2 and our bus."""
