"""The force in one contact, and contacts of two bottles."""
