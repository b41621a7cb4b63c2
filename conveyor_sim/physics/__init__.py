# SPDX-License-Identifier: Apache-2.0
"""Physics of a scene: effects, time step, constant arrays, state and the steps of one tick."""
