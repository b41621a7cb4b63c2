"""The parts of a scene that become devices, one a file: fields, what can be wrong with them, how they are drawn."""
