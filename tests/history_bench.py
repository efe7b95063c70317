"""Records as they could be, without a log: for tests of what is made of them, and of where they are kept."""

import hashlib
import sys
import time

import numpy as np

from ramsight.histories.history_store import HistoryStore
from ramsight.histories.record import Learned, MachineKey, Record
from ramsight.histories.trend import YEAR

KEY = MachineKey("mining-loader", "boom", "1")
BEGUN = 1_767_225_600.0  # 2026-01-01


def record(number, *, years=0.0, leak=1.0, std=0.03, **more):
    """The record of a log that begins so many years after 2026-01-01."""
    digest = hashlib.sha256(f"log {number}".encode()).hexdigest()
    values = {
        "log_digest": digest, "file_digest": digest, "file": f"{number}.csv", "begun": BEGUN + years * YEAR,
        "dated_by": "name", "duration": 600.0, "worked": 300.0, "oil_low": 300.0, "oil_high": 320.0, "oil_mean": 310.0,
        "leak_per_kelvin": 0.04, "leak_per_kelvin2": -5e-4, "references": 4, "available": 0.9, "consistency": 1.0,
        "quantities": {"leak": Learned(leak, std, 1.0, 0.16), "compliance": Learned(1.0, 0.1, 1.0, 0.25)},
        "covariances": {"leak compliance": 1e-4},
    }  # fmt: skip
    return Record(**values | more)


def life(count, *, rate=0.3, span=1.0, seed=0, std=0.03, **more):
    """Records of a machine whose leakage grows by a rate a year."""
    rng = np.random.default_rng(seed)
    at = np.linspace(0.0, span, count)
    return [
        record(
            f"{seed}/{k}", years=float(t), leak=float((1.0 + rate * t) * np.exp(std * rng.normal())), std=std, **more
        )
        for k, t in enumerate(at)
    ]


def write(url, first, last, pause):
    """Add records one after the other and say which are kept: what is killed, and who writes beside another."""
    with HistoryStore(url, makes=True) as store:
        place = store.described(KEY, "digest", "format = 1")
        for number in range(first, last):
            store.add(place, record(number))
            print(number, flush=True)
            time.sleep(pause)


if __name__ == "__main__":
    write(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]))
