# SPDX-License-Identifier: Apache-2.0
"""Contacts of bottles with rails, at rest and moving."""
