"""Helpers for all packages: files, child processes, signals, progress."""
