"""The studio: a page on this machine that shows a machine, its oil and its sensor, and lets one turn the knobs.

`rig` is the machine with its sensors, a sample at a time; `worker` lets one run in a process of its own; `session` is the
page's end of that. `server`, `live_page` and `logs_page` are what a browser sees. Only those three know of a browser.
"""
