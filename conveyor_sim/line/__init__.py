# SPDX-License-Identifier: Apache-2.0
"""Everything on a line except bottle motion: process image, commands, devices, machines, alarms."""
