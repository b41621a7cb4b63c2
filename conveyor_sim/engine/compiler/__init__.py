# SPDX-License-Identifier: Apache-2.0
"""Compilation of kernels, and their cache on disk."""
