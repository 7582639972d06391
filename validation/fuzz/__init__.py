"""Files that are broken at random: every reader either reads them or says in words why not."""
