"""Commands of the command line besides those of `fsm.cli`: one file each."""
