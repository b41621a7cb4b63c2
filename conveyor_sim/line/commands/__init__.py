"""Operations on a line: inputs, control authority, checks, forced signals, read-back."""
