# SPDX-License-Identifier: Apache-2.0
"""Foxglove server of a line."""
