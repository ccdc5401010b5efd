"""Worker processes, threads of the numerical libraries, and random streams."""
