# SPDX-License-Identifier: Apache-2.0
"""Scene -> Model: choice of effects, coefficients, time step, and constant arrays."""

from conveyor_sim.physics.model.model import Model, build_model

__all__ = ["Model", "build_model"]
