"""Values of parameters that are best by an objective, found by trying."""
