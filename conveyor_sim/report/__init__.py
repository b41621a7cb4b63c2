# SPDX-License-Identifier: Apache-2.0
"""Reports of recordings: summary, figures, production, explanations of effects."""
