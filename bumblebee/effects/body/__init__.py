"""What a link weighs, and what pulls at it."""
