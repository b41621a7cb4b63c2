"""Reports of an accuracy study: forecasts, answers, tables and files."""
