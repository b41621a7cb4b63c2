# SPDX-License-Identifier: Apache-2.0
"""Protocol servers: the tags of a line over OPC UA, Modbus, MQTT Sparkplug, Foxglove and a web page."""
