"""The arrays that the kernels work on, grouped by idea. A group, or a column, that a scene does not need is None.

Shapes: S bottle slots, P pairs, G segments, A arcs, H belts (the floor is entry H), T bottle types, M rail materials.
SI units. Columns are float64 unless said otherwise.
"""
