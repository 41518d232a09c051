"""A soak of a lab's servers and machines: short loops again and again while parts of the lab are taken away."""
