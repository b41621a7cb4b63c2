"""What a study says: forecasts, answers, tables and files."""
