"""A loader that works without position sensors: its run and its sensors' tracks as a page, a GIF and figures."""
