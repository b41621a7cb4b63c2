"""What surrounds the physics on a line: the process image, supply and removal, watchdogs. All work at ticks."""
