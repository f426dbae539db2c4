"""The pattern of a number, for files of numbers, which need no expressions."""

# The pattern of a decimal number without a sign. It is possessive, so that long digits are read once.
UNSIGNED = r"(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+"
NUMERAL = rf"[-+]?{UNSIGNED}"  # the pattern of a decimal number
