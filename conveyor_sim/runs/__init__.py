"""A run from start to end: compiling, running, what was left when it stopped, the summary and the report."""
