"""Measured rollouts: the contract's files, importers for other layouts, checks, and the intake that sets bad files aside."""
