"""The policy runs a robot in another process: what goes over the wire, who sends it when, and what is let through."""
