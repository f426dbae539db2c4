"""One question, one module: `run(document)` gives a Report."""
