# SPDX-License-Identifier: Apache-2.0
"""Studies: a scene asked many questions, over points and seeds, on one machine or on many.

from pathlib import Path
from conveyor_sim.studies.load import load_study
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.sweep import sweep

setup = load_study("examples/studies/table_length.yaml")
with Runs(setup, Path("runs/mine")) as runs:
    rows = sweep(runs, setup)
"""
