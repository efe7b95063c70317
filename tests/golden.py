"""An exported folder compiled and run, without the measuring of `write_sensor`."""

from ramsight.deploy.compiler import STRICT, bodies, find_compiler, run


def golden(folder, prefix, *, single=False):
    """What the golden samples' program says; it fails where they do."""
    macro = f"-D{prefix.upper()}_FLOAT={int(single)}"
    sources = [*bodies(folder, prefix), f"{prefix}_test.c"]
    options = [*STRICT, "-O0", "-DROUNDS=1", macro]  # once through the samples: time is not what is asked for
    run([find_compiler(), *options, *sources, "-lm", "-o", "golden"], folder)
    return run([str(folder / "golden")], folder)
