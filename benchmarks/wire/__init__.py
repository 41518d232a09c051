"""What the wire costs and what its safety layer does: latency, tripped rules, faults, success, the loop."""
