"""Entry point of ``python -m fsm``, the command line."""

from fsm.cli import main

if __name__ == "__main__":
    main()
