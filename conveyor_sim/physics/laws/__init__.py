"""Coefficients of the contact laws by pair of materials, and dashpots from restitutions."""
