"""The kinds of answers: how a key and an answer of each are read and compared."""
