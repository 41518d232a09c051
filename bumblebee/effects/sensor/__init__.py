"""What a sensor reports that is not so."""
