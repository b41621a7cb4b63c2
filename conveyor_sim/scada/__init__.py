"""SCADA faces: what a line's tags are to the protocols that plants speak."""
