"""A run as it happens: stepped against wall time, paused, reset, recorded; and a recording played back. Without ROS."""
