# SPDX-License-Identifier: Apache-2.0
"""Modbus server of a line, and the addresses of its tags."""
