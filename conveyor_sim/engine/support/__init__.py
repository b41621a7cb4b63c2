"""What bottles stand on: which belt carries, and its friction."""
