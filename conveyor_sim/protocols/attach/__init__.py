# SPDX-License-Identifier: Apache-2.0
"""A line as the client of a PLC, which is the server. A map assigns tags of the PLC to tags of the line."""
