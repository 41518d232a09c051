"""What: one module a stage of the loop. Each loads artefacts, calls the library, and saves artefacts."""
