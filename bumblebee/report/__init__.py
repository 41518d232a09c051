"""The page that a person reads after a loop: figures, tables and sentences from the stages' results, nothing else."""
