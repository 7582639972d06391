"""Commands of the command line that are not in `fsm.cli`; each command is in one file."""
