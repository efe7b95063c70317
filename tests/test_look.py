"""How large a figure is and for whom, and what the figure of a track says where nothing is known."""

import numpy as np
import pytest
import xarray

import ramsight
from ramsight.api.plotting import look_of
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.tracking.figures import SCREEN, Look, draw_run, draw_track, half_band, tracked_figure, verbatim

TIME = np.arange(0.0, 4.0, 0.02)


def made(**columns):
    """A track with its log, every column a number or of each sample."""
    usual = {
        "position": 0.1, "position_std": 1e-3, "status": 0, "motor_speed": 10.0, "motor_torque": 5.0,
        "oil_temperature": 313.15,
    }  # fmt: skip
    each = {name: ("time", np.broadcast_to(one, TIME.shape).copy()) for name, one in (usual | columns).items()}
    return xarray.Dataset(each, coords={"time": TIME}, attrs={"kind": "track", "unit": "ram", "sensor": "kalman"})


def texts(figure):
    return [one.get_text() for axes in figure.axes for one in axes.texts]


def test_a_figure_is_as_wide_as_asked_and_as_high_as_before():
    before = draw_track(made(), made(), None, "a track")
    figure = draw_track(made(), made(), None, "a track", Look(0.088))
    assert figure.get_figwidth() == pytest.approx(88.0 / 25.4)
    assert figure.get_figheight() == pytest.approx(before.get_figheight())


def test_a_journal_has_thin_lines_and_its_caption_for_a_title():
    screen, journal = (draw_track(made(), made(), None, "a track", Look(None, one)) for one in ("screen", "journal"))
    assert screen._suptitle.get_text() == "a track"
    assert journal._suptitle is None
    for one, other in zip(screen.axes[0].lines, journal.axes[0].lines, strict=True):
        assert other.get_linewidth() == pytest.approx(0.6 * one.get_linewidth())
    run = ramsight.simulate("press", load="100 kN")
    assert draw_run(run, "a run", Look(None, "journal")).axes[0].get_title("left") == ""
    assert draw_run(run, "a run").axes[0].get_title("left") == "a run"


@pytest.mark.parametrize(("width", "columns"), [(None, 5), (0.05, 1), (0.0701, 2), (0.088, 2), (1.0, 5)])
def test_names_of_a_legend_stand_beside_each_other_as_there_is_room(width, columns):
    assert Look(width).beside(5) == columns


def test_a_position_that_is_never_known_is_said_so():
    lost = made(position=np.nan, position_std=np.nan, status=30)
    assert any("give --start" in one for one in texts(draw_track(lost, lost, None, "lost")))
    assert not texts(draw_track(made(), made(), None, "known"))


def test_half_a_band_is_by_its_ends_where_the_sensor_states_them():
    assert half_band(made()) == pytest.approx(1.96e-3, rel=1e-4)
    assert half_band(made(position_low=0.05, position_high=0.11)) == pytest.approx(0.03)


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_plot_takes_width_and_style(tmp_path, suffix):
    figure = ramsight.plot(made(), tmp_path / f"a{suffix}", width="88 mm", style="journal")
    assert figure.get_figwidth() == pytest.approx(88.0 / 25.4)
    assert (tmp_path / f"a{suffix}").stat().st_size > 1000


def test_a_width_or_style_that_is_none_or_of_no_picture_is_refused():
    with pytest.raises(DescriptionError, match=r"width = '8 mm': is out of range \(allowed: 50 mm to 1000 mm\)"):
        ramsight.plot(made(), width="8 mm")
    with pytest.raises(UnknownNameError, match="unknown style 'jurnal'; did you mean 'journal'"):
        ramsight.plot(made(), style="jurnal")
    with pytest.raises(DescriptionError, match="width = '88 mm': is of the picture of a run or a track"):
        ramsight.plot(made().assign_attrs(kind="simulated runs"), width="88 mm")
    with pytest.raises(DescriptionError, match="style = 'journal': is of the picture"):
        look_of(None, "journal", is_drawn=False)
    assert look_of(None, "screen", is_drawn=False) == SCREEN
    assert (SCREEN.is_for_print, SCREEN.width) == (False, None), "the look by default"


def test_the_name_of_a_file_is_no_formula(tmp_path):
    tracked_figure(made(), made(), None, verbatim("a$_$b.csv"), tmp_path / "a.svg")
    assert "a$_$b.csv" in (tmp_path / "a.svg").read_text(encoding="utf-8")
