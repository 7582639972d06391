"""Reading of cases and tables of cases, with their data files; pages of keys and the JSON Schema."""
