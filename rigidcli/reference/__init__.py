"""The pages of `explain`, and the JSON Schema.

All of their texts stand elsewhere: those of keys at the fields of the models, from which the schema is made,
those of results, units, functions and mistakes in the tables of these.
"""
