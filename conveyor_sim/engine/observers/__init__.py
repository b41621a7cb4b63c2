"""Observers: contacts as columns, the energy ledger, damage, the guard."""
