"""What accuracy costs in time: integrators, steps and stiffness compared on a user's own scene."""
