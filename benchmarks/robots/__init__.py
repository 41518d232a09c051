"""Policies of several robots on the same motions: the table and the film of docs/results/robots.md."""
