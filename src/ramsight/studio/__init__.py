"""The studio: a page on this machine that shows a machine, its oil and its sensor, and lets one turn the knobs.

`rig` is the machine with its sensors, a sample at a time; `worker` lets one run in a process of its own; `session` is
the page's end of that. `tracking` answers for a log, `guard` says who may ask. `server`, `live_page`, `logs_page` and
`scene` are what a browser sees; only they need the extra `studio`.
"""
