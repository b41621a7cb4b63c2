"""Foxglove server of a line."""
