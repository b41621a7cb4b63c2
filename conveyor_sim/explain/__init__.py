"""Why each effect is on, what bounds the time step, and what each costs."""
