"""Results as files, whole or not at all, in the format that the suffix says: CSV, Parquet, MF4, MCAP, NetCDF.

`write_table` and `write_dataset` write what is there; `open_table` and `open_dataset` take a long result some rows
after others. `write_text` is for texts, `atomic_path` for files of any other kind, `whole_folder` for several that
belong together. `Exclusive` keeps other programs from a file.
`flush_folder` makes what was moved or removed last through a power loss.
"""

from ramsight.output.atomic import (
    FIGURE_FILES,
    atomic_path,
    check_figure,
    check_folder,
    check_target,
    flush_folder,
    whole_folder,
    write_text,
)
from ramsight.output.cells import DECIMALS, Coded
from ramsight.output.command_files import check_apart, check_state
from ramsight.output.dataset import DATASET_FILES, DATASETS, column_name, open_dataset, write_dataset
from ramsight.output.exclusive import Exclusive, HeldError
from ramsight.output.table_file import TABLE_FILES, TABLES, check_installed, check_table, open_table, write_table

__all__ = [
    "DATASETS", "DATASET_FILES", "DECIMALS", "FIGURE_FILES", "TABLES", "TABLE_FILES", "Coded", "Exclusive",
    "HeldError", "atomic_path", "check_apart", "check_figure", "check_folder", "check_installed", "check_state",
    "check_table", "check_target", "column_name", "flush_folder", "open_dataset", "open_table", "whole_folder",
    "write_dataset", "write_table", "write_text",
]  # fmt: skip
