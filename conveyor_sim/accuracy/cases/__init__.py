# SPDX-License-Identifier: Apache-2.0
"""Closed forms of a scene's laws, and how far its settings are off in them."""
