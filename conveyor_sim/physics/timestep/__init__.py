# SPDX-License-Identifier: Apache-2.0
"""Choice of the time step: bounds, errors of the integrators, predicted errors, presets."""
