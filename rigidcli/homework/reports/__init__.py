"""Reports on judgements: texts that are written piece by piece."""
