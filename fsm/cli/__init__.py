"""Command line: `fsm.cli.command_line`, files of further commands, and the cases of `fsm init`."""


def main() -> None:
    """Entry point of ``fsm``."""
    from fsm.cli.command_line import main as run

    run()
