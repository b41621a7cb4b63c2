# SPDX-License-Identifier: Apache-2.0
"""Lists of neighbours of a bottle, and their rebuilds."""
