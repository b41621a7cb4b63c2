"""What sensors of a line look for in a tick: beams that are blocked, lines that are passed, regions with bottles in."""
