"""Laws without a name of their own."""
