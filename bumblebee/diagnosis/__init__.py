"""Diagnosis: measured rollouts tell which effect the declared model lacks (paper, section 3.3)."""
