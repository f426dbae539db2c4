"""The entries of the fields of a document: quantities, units, expressions in the parameters, sections."""
