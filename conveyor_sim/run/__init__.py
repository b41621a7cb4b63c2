"""Running a scene: the stepping thread, wall time, controllers, lockstep and playback."""
