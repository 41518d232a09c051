"""Other groups' policies, as they published them: any ONNX file whose contract file says what goes in and out."""

from pathlib import Path

CONTRACTS = {"twist2": Path(__file__).parent / "twist2.yaml"}
"""Contract files that come along, by the name by which a user asks for them."""
CHOICES = ("own", "declared")
"""Whose gains, and whose model: the peer's, or those that our policies are tried with."""
