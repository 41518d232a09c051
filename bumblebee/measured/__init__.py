"""Measured rollouts: the contract's files, importers, checks, and an intake that sets bad files aside."""
