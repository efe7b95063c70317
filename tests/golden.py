"""An exported folder compiled and run, without the measuring of `write_sensor`."""

from ramsight.deploy.compiler import STRICT, find_compiler, run


def golden(folder, prefix, *, single=False):
    """What the golden samples' program says; it fails where they do."""
    macro = f"-D{prefix.upper()}_FLOAT={int(single)}"
    run([find_compiler(), *STRICT, "-O0", macro, f"{prefix}.c", f"{prefix}_test.c", "-lm", "-o", "golden"], folder)
    return run([str(folder / "golden")], folder)
