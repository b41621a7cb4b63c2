"""Everything on a line except bottle motion: process image, commands, devices, machines, alarms."""
