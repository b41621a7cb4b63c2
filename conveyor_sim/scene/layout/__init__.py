# SPDX-License-Identifier: Apache-2.0
"""Layout language: conveyors by path, guides and devices along them, expanded to belts, rails and coordinates."""
