"""Reports of recordings: summary, figures, production, explanations of effects."""
