# SPDX-License-Identifier: Apache-2.0
"""A line as an edge node of MQTT Sparkplug B."""
