"""Ledgers of a run: energy, damage, clogging, elastic energy of contacts."""
