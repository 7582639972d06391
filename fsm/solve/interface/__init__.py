"""Face between solvers and models: the `System`, its scales and the records that it returns."""
