"""Figures of scenes and recordings; the drawing style that all figures share."""
