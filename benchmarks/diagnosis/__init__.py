"""The diagnosis measured: its cost, its numbers, its errors beside other tools."""
