"""A line as an edge node of MQTT Sparkplug B."""
