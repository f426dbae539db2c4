"""The document: what a person may write, read into frozen models that are the domain objects."""
