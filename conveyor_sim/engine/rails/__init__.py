"""Contacts of bottles with rails, at rest and moving."""
