"""What builds exported C: CMake (a Zephyr module, too) and PlatformIO."""

from __future__ import annotations

from collections.abc import Iterable

from ramsight.deploy.c_text import headings, indented, template


def build_files(names: Iterable[str], prefix: str, machine: str, unit: str) -> dict[str, str]:
    """Build files of an exported folder, text by name.

    Args:
        names: of the folder's files.
        prefix: of the names in the C; the library's name.
        machine: the machine's name.
        unit: the unit's name.

    Example:
        >>> files = build_files(["a.h", "a.c", "a_test.c"], "a", "press", "ram")
        >>> sorted(files)
        ['CMakeLists.txt', 'library.json', 'zephyr/module.yml']
        >>> [line for line in files["CMakeLists.txt"].splitlines() if "add_library" in line or "foreach(" in line]
        ['add_library(a STATIC ${a_sources})', '  foreach(name a_test)', '  endforeach()']
    """
    bodies = sorted(name.removesuffix(".c") for name in names if name.endswith(".c"))
    tests = [name for name in bodies if name.endswith("_test")]
    common = headings(prefix, machine, f"Virtual position sensor of the {unit}")
    sources = indented(f"{name}.c" for name in bodies if name not in tests)
    return {
        "CMakeLists.txt": template("CMakeLists.txt", sources=sources, tests=" ".join(tests), **common),
        "library.json": template("library.json", **common),
        "zephyr/module.yml": template("module.yml", **common),
    }
