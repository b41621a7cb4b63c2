# SPDX-License-Identifier: Apache-2.0
"""Effects of a scene: why each is enabled, and its cost in time."""
