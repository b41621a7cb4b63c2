# SPDX-License-Identifier: Apache-2.0
"""Figures of scenes and recordings; the drawing style that all figures share."""
