# SPDX-License-Identifier: Apache-2.0
"""Comparison with published experiments: one module per source; docs/validation.md is made from their stored runs."""
