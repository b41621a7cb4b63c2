# SPDX-License-Identifier: Apache-2.0
"""Hosting of the protocol servers: processes, restarts, settings, progress."""
