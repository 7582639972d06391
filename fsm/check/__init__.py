"""Report of `fsm check`: what a case is, what is left out, and what is approximated."""
