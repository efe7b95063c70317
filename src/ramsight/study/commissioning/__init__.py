"""A machine's commissioning judged from its drive's log: checks in order, a verdict with reasons, a page to sign."""
