"""A sheet with parallel slits, pulled: force predicted for a published test whose curve is not used here."""
