"""Effects: the law of each, what in a scene calls for it, and its bound on the time step.

An effect that no scene part calls for is absent: its arrays are None and its branch is not compiled. Each family of
effects has a file. `laws/` and `model/` build the arrays; `engine/` has the laws.
"""
