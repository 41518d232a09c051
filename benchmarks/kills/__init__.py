"""Cost of a kill: each process of the loop and each command, hit in every way, then started again."""
