"""Where in a tick an integrator is called."""

START, RESUME = 0, 1
