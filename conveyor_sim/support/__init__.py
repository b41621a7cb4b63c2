# SPDX-License-Identifier: Apache-2.0
"""Helpers for all packages: files, child processes, signals, progress."""
