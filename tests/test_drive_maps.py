"""The catalogue of maps: the bytes of each drive's frames are read as its source reads them."""

import re
from pathlib import Path

import numpy as np
import pytest

from ramsight.errors import DescriptionError
from ramsight.logs import read_log
from ramsight.logs.drive_maps import drive_maps
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text

RPM = np.pi / 30.0
PAGE = Path(__file__).parents[1] / "docs/reference/log-formats.md"


def big(value, width=2):
    return (int(value) & (1 << 8 * width) - 1).to_bytes(width, "big")


def little(value, width=2):
    return (int(value) & (1 << 8 * width) - 1).to_bytes(width, "little")


FRAMES = {
    "brusa-dmc5": lambda n, m: [(0x258, bytes(4) + big(100 * m) + big(n))],
    "c300": lambda n, m: [(0x0CFF7902, bytes(2) + big(4 * (m + 5000)) + big(n + 12000) + bytes(2))],
    "cia402": lambda n, m: [(0x181, little(n, 4) + little(10 * m))],
    "dmoc645": lambda n, m: [(0x23B, big(n + 20000) + bytes(6)), (0x23A, big(10 * m + 30000) + bytes(6))],
    "nissan-leaf": lambda n, m: [(0x1DA, bytes(2) + big(2 * m & 0x7FF) + big(2 * n) + bytes(2))],
    "rinehart-pm": lambda n, m: [
        (0xA5, bytes(2) + little(n) + bytes(4)), (0xAC, bytes(2) + little(10 * m) + bytes(4))
    ],
    "sevcon-gen4": lambda n, m: [(0x181, little(n, 4) + little(16 * m))],
    "sevcon-gen5": lambda n, m: [(0x1918FF71, little(16 * m) + little(n) + bytes(4))],
    "uqm-powerphase": lambda n, m: [(0x209, little(10 * m + 32128) + bytes(4) + little(2 * n + 32128))],
}  # fmt: skip
"""Frames of a speed [rpm] and a torque [N m], by the arithmetic of the source."""
TIME = np.arange(50) * 0.02
SPEED = np.round(1500.0 * np.sin(3.0 * TIME)).astype(int)
TORQUE = np.round(40.0 * np.cos(TIME)).astype(int) - 20


def log_of(folder, name):
    if name == "ovms-twizy":
        header = "timestamp,kph,rpm,throttle,mot_torque_limit,mot_torque_demand,mot_torque,mot_slipfreq,mot_outputfreq"
        rows = [f"{1000 * at:.0f},0,{n},0,70,0,{m},0,0" for at, n, m in zip(TIME, SPEED, TORQUE, strict=True)]
        (folder / "log.csv").write_text("\n".join([header, *rows]) + "\n")
        return folder / "log.csv"
    pytest.importorskip("cantools")
    lines = []
    for at, n, m in zip(TIME, SPEED.tolist(), TORQUE.tolist(), strict=True):
        for place, (key, data) in enumerate(FRAMES[name](n, m)):
            text = f"{key:08X}" if key > 0x7FF else f"{key:03X}"
            lines.append(f"({1000.0 + at + 1e-4 * place:.6f}) can0 {text}#{data.hex().upper()}")
    (folder / "log.log").write_text("\n".join(lines) + "\n")
    return folder / "log.log"


@pytest.mark.parametrize("name", [one.name for one in drive_maps()])
def test_frames_are_read_as_the_source_reads_them(tmp_path, name):
    file = log_of(tmp_path, name)
    text = map_text(inspect_log(file, name), tmp_path)
    assert '# constant = "45 degC"' in text  # nobody's drive measures the oil: it is asked for
    text = text.replace("# [temperature]  # needed", "[temperature]  # needed").replace("# constant =", "constant =")
    text = text.replace("[torque]\n", '[torque]\nrated = "100 N m"\n') if name == "cia402" else text
    (tmp_path / "map.toml").write_text(text)
    log = read_log(file, tmp_path / "map.toml")
    assert len(log.time) >= len(TIME) - 1
    places = np.round(log.time.values / 0.02).astype(int)
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED[places], atol=1e-6)
    np.testing.assert_allclose(log.motor_torque.values, TORQUE[places], atol=1e-6)


@pytest.mark.parametrize("name", [one.name for one in drive_maps() if one.frames or one.columns])
def test_a_log_of_a_drive_that_is_known_is_recognised(tmp_path, name):
    assert f"logs inspect --map {name} tries it" in map_text(inspect_log(log_of(tmp_path, name)))


def test_a_map_of_the_catalogue_knows_no_oil(tmp_path):
    with pytest.raises(DescriptionError, match=r"dmoc645\.toml: has no \[temperature\]; name the oil's channel"):
        read_log(log_of(tmp_path, "dmoc645"), "dmoc645")


def test_the_page_lists_every_map_with_its_source():
    text = PAGE.read_text(encoding="utf-8")
    (chapter,) = re.findall(r"^## Maps of drives\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)
    rows = re.findall(r"^\| `([a-z0-9-]+)` \| (.+?) \| (.+?) \| (.+?) \|$", chapter, re.MULTILINE)
    assert rows == [(one.name, one.title, one.source, one.tried) for one in drive_maps()]
    assert len(rows) >= 10
    assert all("https://" in source or "CiA 402" in source for _, _, source, _ in rows)
