"""What a person may write: the text of a document, its sections, and what is set from outside."""
