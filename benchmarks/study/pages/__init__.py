"""Pages of the study: tables and curves with intervals, a file each."""
