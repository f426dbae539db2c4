"""The search for conserved quantities."""
