"""Choice of the time step: bounds, errors of the integrators, predicted errors, presets."""
