"""Compensation at the joints: from the effects that were found to numbers by joint that the runner undoes."""
