"""The studio: a page on this machine that shows a machine, its oil and its sensor, and lets one turn the knobs.

`rig` is the machine with its sensors, a sample at a time; `playing` moves its levers, `scenarios` play on it; `worker`
lets one run in a process of its own, and `session` is the page's end of that. Processes share what `first_start` has to
compile. `draft` is a description that is being written, `uploaded_log` answers for a log, `thinning` for what a screen
shows of it; `spawned` runs long work in processes and ends them. `visit` is what the tabs of one visitor share.
`web_server` says who may ask; it, `tabs` and the pages are what a browser sees, and only they need the extra `studio`.
"""
