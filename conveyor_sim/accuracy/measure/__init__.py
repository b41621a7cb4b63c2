"""Errors and cost of settings, measured on a scene."""
