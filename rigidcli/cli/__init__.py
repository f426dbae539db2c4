"""The command line: parse it, call one study for each document, print its report."""
