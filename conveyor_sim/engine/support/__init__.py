"""Belts, floor and bases: the belt that carries a bottle, and its friction."""
