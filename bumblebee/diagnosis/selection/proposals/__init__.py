"""Starts that slopes do not show: each tries one kind of effect over its whole range."""
