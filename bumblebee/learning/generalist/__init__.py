"""The generalist: experts become one policy by DAgger (paper, section 3.4): a transformer or an MLP."""
