"""Effects of a scene: why each is enabled, and its cost in time."""
