"""Evaluation: success rate, MPJPE, MPKPE with intervals, under one frozen and hashed contract."""
