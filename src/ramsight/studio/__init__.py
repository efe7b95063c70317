"""The studio: a page on this machine that shows a machine, its oil and its sensor, and lets one turn the knobs.

`rig` is the machine with its sensors, a sample at a time; `playing` moves its levers, `energy` sorts where its energy
goes; `worker` lets one run in a process of its own, and `session` is the page's end of that. `draft` is a description
that is being written, `tracking` answers for a log, `thinning` for what a screen shows of it, `studies` for a data
sheet; `job` runs them in processes, `spawned` ends those. `visit` is what the tabs of one visitor share, `guard` says
who may ask. `server`, `tabs`, `files`, `scene` and the pages are what a browser sees; only they need the extra
`studio`.
"""
