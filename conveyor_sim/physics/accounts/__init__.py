"""Books on a run: the energy ledger, damage, the elastic energy of contacts."""
