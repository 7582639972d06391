"""Contact in piles: many layers are pressed, and many plates are thrown; bounds and balances are checked (see README.md)."""
