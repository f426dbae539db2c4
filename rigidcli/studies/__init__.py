"""The studies: one module or package for each question, whose `run(document)` gives a Report."""
