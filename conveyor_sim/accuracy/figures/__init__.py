"""Figures of an accuracy study."""
