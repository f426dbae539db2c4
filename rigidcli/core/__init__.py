"""The numeric core: numbers and arrays in, numbers and arrays out, all in SI units.

No files, text, colours or documents here. Formulas use + - * / and powers, and what else they
need they take from an `Arithmetic`; so the same line works on floats, on arrays and on exact numbers.
"""
