"""Line control, structured as PLC programs are: process image in, commands out, once a tick.

`scan.py` says what a controller is, `alarm.py` what it may declare of its alarms, `blocks.py` has the function blocks
of IEC 61131-3, `load.py` finds a controller by name; every other file is one control task. Only the standard library is
imported, and nothing of the simulation: what a controller knows of the line is what its inputs tell.

A controller is a dataclass whose fields are its parameters: SI units; belts and photo-eyes by their names in the
scene, signals and commands by their names in the process image. It answers all its commands in every scan, as a PLC
writes its outputs, unless it says that it answers only while it acts (`jam.JamClearing`, `eye_monitor.EyeMonitor`):
such a one goes before the others in `scan.priority`. Its memory starts empty: make a new one for a new run.
"""

from conveyor_sim.control.alarm import Alarm
from conveyor_sim.control.load import load
from conveyor_sim.control.scan import ALARMS, Constant, ControlError, Controller, Inputs, priority, together

__all__ = ["ALARMS", "Alarm", "Constant", "ControlError", "Controller", "Inputs", "load", "priority", "together"]
