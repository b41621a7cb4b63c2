# SPDX-License-Identifier: Apache-2.0
"""Effects: the law of each, the fields of a scene that enable it, and its bound on the time step.

An effect that no part of the scene enables is absent: its arrays are None and its branch is not compiled. Each family
of effects has a file. `laws/` and `model/` build the arrays; `engine/` has the laws.
"""
