"""Lists of what is near a bottle, and when they are made anew."""
