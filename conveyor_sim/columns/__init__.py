"""Observations as columns of numbers: one array per quantity."""
