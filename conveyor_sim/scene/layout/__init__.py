"""Layout language: conveyors by path, guides and devices along them, expanded to belts, rails and coordinates."""
