# SPDX-License-Identifier: Apache-2.0
"""ROS 2: the node of a simulation, the node of a controller, and the main job that runs both.

Only modules of this package import rclpy. Rules that need no ROS (lockstep, pacing) are in `run`.
"""
