"""Drawings: plans read from DXF files and written as DXF and SVG."""
