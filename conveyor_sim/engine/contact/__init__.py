"""Force in one contact, and contacts of two bottles."""
