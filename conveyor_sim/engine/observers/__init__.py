"""What looks on: contacts as columns, the energy ledger, damage, the guard."""
