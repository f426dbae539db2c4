"""`python -m rigidcli` is the command `rigidcli`."""

from rigidcli.cli.app import main

main()
