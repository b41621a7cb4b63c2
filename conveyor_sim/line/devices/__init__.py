# SPDX-License-Identifier: Apache-2.0
"""Devices of a line: belts, feeds, movers and sensors; one class per file."""
