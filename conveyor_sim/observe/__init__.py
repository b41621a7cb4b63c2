"""Read-only measurements of a simulation."""
