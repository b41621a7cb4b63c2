"""Threads that step together, with the bits of a single one."""
