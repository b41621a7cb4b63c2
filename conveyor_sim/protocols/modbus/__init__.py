"""Modbus server of a line, and the addresses of its tags."""
