"""Threads that step together, to the same bits as one."""
