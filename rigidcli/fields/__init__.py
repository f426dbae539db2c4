"""What may stand in a field of a document: quantities, units, expressions in the parameters, sections."""
