# SPDX-License-Identifier: Apache-2.0
"""Accuracy studies: error against run time of integrators, steps and stiffness on a user's scene."""
