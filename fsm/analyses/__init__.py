"""From a case to what is solved, by kind of analysis; all kinds are recorded, resumed, summed up and drawn in one way."""
