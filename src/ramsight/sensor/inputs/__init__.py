"""The sample: what of it is possible, and what is corrected before it is used."""
