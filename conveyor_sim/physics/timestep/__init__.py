"""How long a time step may be: bounds, what each integrator misses, predicted errors, presets."""
