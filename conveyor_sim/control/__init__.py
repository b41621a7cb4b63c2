# SPDX-License-Identifier: Apache-2.0
"""Line control, structured as PLC programs are: process image in, commands out, once per tick.

`scan.py` defines controllers, `alarm.py` their alarm declarations, and `blocks.py` the function blocks of IEC 61131-3.
`load.py` finds a controller by name, and `cell.py` applies one to a cell. Every other file is one control task. Only
the standard library is imported, and nothing of the simulation: a controller knows the line by its inputs alone.

A controller is a dataclass whose fields are its parameters: SI units; belts and photo-eyes by their names in the scene,
named drives as `drives/<name>`, signals and commands by their names in the process image. It returns all its commands
in every scan, as a PLC writes its outputs. Exceptions state that they return commands only while they act
(`jam.JamClearing`, `eye_monitor.EyeMonitor`); they precede the others in `scan.priority`. Memory starts empty, so make
a new controller for a new run.
"""

from conveyor_sim.control.alarm import Alarm
from conveyor_sim.control.cell import in_cell
from conveyor_sim.control.load import load
from conveyor_sim.control.scan import ALARMS, Constant, ControlError, Controller, Inputs, priority, together

__all__ = [
    "ALARMS", "Alarm", "Constant", "ControlError", "Controller", "Inputs", "in_cell", "load", "priority", "together",
]  # fmt: skip
