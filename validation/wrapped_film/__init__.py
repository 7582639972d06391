"""Film that is wrapped on a hub, unrolled and unwound, compared with closed forms."""
