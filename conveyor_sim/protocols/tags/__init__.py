# SPDX-License-Identifier: Apache-2.0
"""Tags of a line and their providers: a simulated scene, a recording, a mirror built from topics."""
