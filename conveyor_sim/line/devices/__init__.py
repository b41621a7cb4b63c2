"""Devices of a line: belts, feeds, movers and sensors; one class per file."""
