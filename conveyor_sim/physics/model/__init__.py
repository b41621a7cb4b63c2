"""From a scene to constant arrays: effects are chosen, coefficients found, the time step bounded, arrays filled."""

from conveyor_sim.physics.model.model import Model, build_model

__all__ = ["Model", "build_model"]
