"""How often intervals of `fsm calibrate force` hold the truth."""
