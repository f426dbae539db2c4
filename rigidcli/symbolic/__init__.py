"""Expressions: reading them safely, exact arithmetic, and mechanics by algebra."""
