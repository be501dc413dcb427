"""Shaded surfaces: a plan view in a plane, and solids in space."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.figure import Figure, Panel, Surface, figure_csv

PNG = b"\x89PNG\r\n\x1a\n"


def plan_view():
    """A ring of quadrilaterals around a hole, mm."""
    angle = np.linspace(0, 2 * np.pi, 25)
    rings = np.stack([r * np.stack([np.cos(angle), np.sin(angle)], axis=1) for r in (4.5, 5.5, 6.5)])
    corners = [rings[:-1, :-1], rings[1:, :-1], rings[1:, 1:], rings[:-1, 1:]]
    faces = np.stack(corners, axis=2).reshape(-1, 4, 2)
    return Surface(faces, np.linspace(0, 300, len(faces)), "pressure, MPa")


def space_view():
    """Faces across and along a strip at different depths, and the outlines of those at rest."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    rest = np.stack([square + np.array([0, 0, i]) for i in range(6)])
    faces = rest + np.array([0, 0.3, 0])
    return Surface(faces, np.linspace(0, 1, 6), edges=rest)


VIEWS = {"plane": plan_view, "space": space_view}


def figure(surface):
    return Figure("f", "", (Panel("head", "z, mm", "x, mm", surface=surface),), 1)


def shades(drawing):
    with Image.open(io.BytesIO(getattr(drawing, "png", drawing))) as image:
        return np.asarray(image.convert("RGB")).astype(int)


@pytest.mark.parametrize("view", VIEWS)
def test_a_surface_is_drawn_and_drawn_alike(view):
    png = draw(figure(VIEWS[view]())).png
    assert png.startswith(PNG)
    assert png == draw(figure(VIEWS[view]())).png
    pixels = shades(png)
    assert pixels.shape[1] == 910
    assert 0.4 < (pixels.min(axis=2) > 200).mean() < 0.999  # mostly paper
    assert (np.ptp(pixels, axis=2) > 60).mean() > 0.005  # and colour


@pytest.mark.parametrize("view", VIEWS)
def test_data_of_a_surface(view):
    surface = VIEWS[view]()
    rows = list(csv.reader(io.StringIO(figure_csv(figure(surface)))))[1:]
    assert len(rows) == len(surface.faces)
    assert {(row[0], row[1], row[4]) for row in rows} == {("head", surface.label, "")}
    places = np.array([[float(x) for x in row[2].split()] for row in rows])
    np.testing.assert_allclose(places, surface.faces.mean(axis=1), atol=1e-8)
    np.testing.assert_array_equal([float(row[3]) for row in rows], surface.values)


def test_what_is_near_covers_what_is_far_in_any_order():
    surface = space_view()
    png = draw(figure(surface)).png
    assert png == draw(figure(replace(surface, faces=surface.faces[::-1], values=surface.values[::-1]))).png
    # Two faces, one straight behind the other along the line of sight: only the colour of the near one is seen.
    towards_reader = np.array([-0.810, 0.451, -0.374])
    near, values = surface.faces[0], np.array([1.0, 0.4])
    both = np.stack([near, near - 2 * towards_reader])
    alone = shades(draw(figure(Surface(both[:1], values[:1]))))
    for faces, seen, share in ((both, values, (0.0, 0.005)), (both[::-1], values, (0.02, 1.0))):
        different = (abs(shades(draw(figure(Surface(faces, seen)))) - alone) > 8).any(axis=2).mean()
        assert share[0] <= different <= share[1]


def test_nothing_that_presses_is_light_throughout():
    surface = plan_view()
    nothing = shades(draw(figure(replace(surface, values=0 * surface.values, label=""))))
    pressed = shades(draw(figure(replace(surface, label=""))))
    assert (np.ptp(nothing, axis=2) > 60).mean() < 0.5 * (np.ptp(pressed, axis=2) > 60).mean()


def test_only_plan_views_have_axes_and_only_named_values_a_scale():
    """Ink in the margins: labels of the axes at the left, and a scale of colours at the right."""
    surface = plan_view()
    with_scale, without = (shades(draw(figure(s))) for s in (surface, replace(surface, label="")))
    assert (with_scale[:, -60:].min(axis=2) < 100).any()
    assert not (without[:, -60:].min(axis=2) < 100).any()
    space = shades(draw(figure(space_view())))
    assert (without[-45:].min(axis=2) < 100).any()
    assert not (space[-45:].min(axis=2) < 100).any()
