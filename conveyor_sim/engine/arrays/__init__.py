# SPDX-License-Identifier: Apache-2.0
"""Arrays of the kernels, in groups. A group or column that a scene does not need is None.

Shapes: S bottle slots, P pairs, G segments, A arcs, H belts (the floor is entry H), T bottle types, M rail materials.
SI units. Columns are float64 unless stated otherwise.
"""
