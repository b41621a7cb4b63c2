"""Lists of neighbours of a bottle, and their rebuilds."""
