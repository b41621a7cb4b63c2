"""The guard: checks every tick for states that no bottle can reach, and has the tick repeated or the run stopped."""
