# SPDX-License-Identifier: Apache-2.0
"""Errors and cost of settings, measured on a scene."""
