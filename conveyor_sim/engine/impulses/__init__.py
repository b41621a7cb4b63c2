# SPDX-License-Identifier: Apache-2.0
"""Contacts as impulses: implicit contacts in short substeps, swept by Gauss-Seidel (`integrators/impulses.py`)."""
