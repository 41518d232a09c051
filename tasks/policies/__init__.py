"""Policies between stages: training, candidates, cards, copies."""
