"""Contact in piles: many layers pressed, many plates thrown, against bounds and balances; see README.md."""
