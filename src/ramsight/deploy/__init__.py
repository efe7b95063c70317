"""Into the machine: sensors as C99 for a control unit and on a bus; sensors and plants as FMUs for a simulator.

Its doors are `c_folder.write_sensor`, `fmu.write_fmu` and `encoder`; the C comes from the same graphs that ramsight
itself runs.
"""
