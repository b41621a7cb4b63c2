"""Hosting of the protocol servers: processes, restarts, settings, progress."""
