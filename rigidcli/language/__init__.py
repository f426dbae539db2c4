"""The expression language: tokens, parser, tree, text, evaluation, generated code."""
