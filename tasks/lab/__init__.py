"""Where a lab keeps what stages log: its databases and store, and private folders."""
