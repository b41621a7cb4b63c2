"""Figures of studies and optimisations."""
