# SPDX-License-Identifier: Apache-2.0
"""Parts of a scene that become devices, one per file: fields, checks, and marks."""
