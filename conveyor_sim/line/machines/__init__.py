"""Machines that follow the PackML state model, their counters and time accounts."""
