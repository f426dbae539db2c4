"""What `explain` tells: keys, shapes, units, functions, results, mistakes, exit codes: from their own tables.

Nothing here describes them a second time: what is said of a key stands at its field in the model, of a result
in the table of results, and so on.
"""
