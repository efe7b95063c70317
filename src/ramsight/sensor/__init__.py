"""Where is it: virtual sensors that know only what a drive reports."""
