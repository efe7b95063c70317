"""Where a machine's tool is, and what it carries: from the positions and loads of its units, by its mechanism."""
