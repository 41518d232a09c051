"""Cost of the wire and answers of its safety layer: latency, tripped rules, faults, success, the loop."""
