# SPDX-License-Identifier: Apache-2.0
"""Drawings: plans read from DXF files and written as DXF and SVG."""
