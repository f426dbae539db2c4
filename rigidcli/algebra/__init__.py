"""Exact expressions and matrices of them. What has no real value, or is too large, raises ExpressionError."""
