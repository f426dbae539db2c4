"""The pages of `explain`, and the JSON Schema, from the models and the tables of results, units, codes."""
