"""Wings of flexible panels, compared with rigid panels and with beams on springs."""
