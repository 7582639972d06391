"""What three papers say in words and numbers, one by one."""
