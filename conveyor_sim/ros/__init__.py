"""The ROS 2 face: a node over Simulation, the PLC-like controller beside it, and the main job that runs both.

Only the modules of this package import rclpy, and those that hold rules (lockstep, pacing, domain) do
without it, so that they can be read and tested by themselves.
"""
