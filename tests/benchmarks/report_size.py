"""Size and time of a report on grains that fall into a box.

    python tests/benchmarks/report_size.py [--sizes 10000x200 100000x50] [--folder FOLDER]
        [--beside k3d plotly] [--browser]

Grains of equal density and radii of 0.35 to 0.5 mm, at random velocities and under tilted gravity, fall into
a box without a lid and collide. The trajectory is kept in FOLDER, if it is given, for the next time. Times
are processor times of this process; ``--browser`` adds the wall time until the page is ready in chromium (the
extra ``browser``). ``--beside`` writes the positions of the same frames with other packages, if they are
installed: a snapshot of K3D, an HTML file of plotly with its library inside.
"""

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tests.browser import SWITCHES
from tisim.effects import Granular, Gravity, HertzMaterial, MindlinForce, RestitutionDamping, Walls
from tisim.geometry import Plane
from tisim.io.reader import frames
from tisim.report import run_report
from tisim.report.compressed_trajectory import compress
from tisim.report.contact_network import contact_network
from tisim.report.kept_frames import KeptFrames
from tisim.report.viewer_data import ReportOptions
from tisim.steppers import FixedStep, Verlet

SPACING, STEP, MOST_STEPS = 1.2e-3, 1e-5, 10_000
PARTICLE_STEPS = 2e8
"""Steps of all grains together; the duration follows."""


def scene(number: int) -> tisim.Scene:
    """Grains above the floor of a box, somewhat higher than wide."""
    side = round((0.8 * number) ** (1 / 3))
    sites = np.stack(np.unravel_index(np.arange(number), (-(-number // side**2), side, side))[::-1], axis=1)
    draw, width = np.random.default_rng(1), SPACING * side
    walls = (((0, 0, 0), (1, 0, 0)), ((width, 0, 0), (-1, 0, 0)), ((0, 0, 0), (0, 1, 0)))
    walls += (((0, width, 0), (0, -1, 0)), ((0, 0, 0), (0, 0, 1)))
    return tisim.Scene(
        name=f"{number} grains",
        particles=tisim.Particles(
            position=SPACING * (sites + 0.5) + draw.uniform(-8e-5, 8e-5, (number, 3)),
            velocity=draw.uniform(-0.2, 0.2, (number, 3)),
            radius=draw.uniform(0.35e-3, 0.5e-3, number),
            density=2500.0,
        ),
        materials={"glass": tisim.Material(young=5e6, poisson=0.25, restitution=0.5, friction=0.5)},
        effects=(
            Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce()),
            Walls(planes=tuple(Plane(point=point, normal=normal) for point, normal in walls)),
            Gravity(acceleration=(3.0, 0.0, -9.0)),
        ),
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=STEP * min(MOST_STEPS, PARTICLE_STEPS / number),
    )


def recorded(number: int, count: int, folder: Path) -> Path:
    """The trajectory of a number of grains and of frames; the run is made if it is not in the folder."""
    path = folder / f"{number}x{count}" / "trajectory.h5"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        simulation = tisim.Simulation(scene(number))
        simulation.load(scene(number))
        with tisim.Recording(path, frames=count - 1).observer(simulation) as observer:
            simulation.run(observers=[observer])
        simulation.close()
    return path


def timed(work: Callable[..., Any], *arguments: Any, **named: Any) -> tuple[Any, float]:
    """The result of a function, and its processor time, s."""
    began = time.process_time()
    return work(*arguments, **named), time.process_time() - began


def with_k3d(places: np.ndarray, radius: np.ndarray, path: Path) -> None:
    """Write a snapshot of K3D."""
    import k3d

    plot = k3d.plot()
    moving = {str(k): frame.astype(np.float32) for k, frame in enumerate(places)}
    plot += k3d.points(positions=moving, point_size=float(2 * radius.mean()), shader="3d")
    path.write_text(plot.get_snapshot())


def with_plotly(places: np.ndarray, radius: np.ndarray, path: Path) -> None:
    """Write an HTML file of plotly with its library."""
    import plotly.graph_objects as go

    def cloud(frame: np.ndarray) -> go.Scatter3d:
        x, y, z = frame.astype(np.float32).T
        return go.Scatter3d(x=x, y=y, z=z, mode="markers")

    figure = go.Figure(data=[cloud(places[0])], frames=[go.Frame(data=[cloud(frame)]) for frame in places])
    figure.write_html(path, include_plotlyjs=True)


PEERS = {"k3d": with_k3d, "plotly": with_plotly}


def ready(path: Path) -> float:
    """The wall time (s) until the page is ready in a browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=SWITCHES)
        page = browser.new_page()
        began = time.perf_counter()
        page.goto(path.as_uri())
        page.wait_for_selector("html[data-ready=yes]", timeout=300_000)
        waited = time.perf_counter() - began
        browser.close()
    return waited


def report(path: Path, folder: Path, in_browser: bool) -> None:
    """Print the parts of the report on a trajectory."""
    with frames(path) as sequence:
        kept = KeptFrames(sequence)
        trajectory, encoding = timed(compress, kept, range(len(kept)))
        network, finding = timed(contact_network, kept, trajectory)
    sizes = {one.name: len(one.data) / 1e6 for one in trajectory.columns}
    print(f"  columns: {', '.join(f'{name} {size:.2f} MB' for name, size in sizes.items())}")
    print(f"  encoding {encoding:.1f} s, contacts {len(network.data()) / 1e6:.2f} MB in {finding:.1f} s")
    for contacts in (False, True):
        options = ReportOptions(contacts=contacts)
        out, used = timed(run_report, path, folder / "report.html", options=options)
        with_them = "with" if contacts else "without"
        text = f"  report {with_them} contacts: {out.stat().st_size / 1e6:.1f} MB in {used:.1f} s"
        print(text + f", ready in {ready(out):.1f} s" * in_browser)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sizes", nargs="*", default=["10000x200", "100000x50"])
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--beside", nargs="*", default=[], choices=PEERS)
    parser.add_argument("--browser", action="store_true")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as own:
        folder = asked.folder or Path(own)
        for size in asked.sizes:
            number, count = map(int, size.split("x"))
            path = recorded(number, count, folder)
            print(f"{number} grains, {count} frames: trajectory {path.stat().st_size / 1e6:.1f} MB")
            report(path, Path(own), asked.browser)
            for name in asked.beside:
                with frames(path) as sequence:
                    places = np.array([frame.arrays["position"] for frame in sequence])
                    radius = sequence[0].arrays["radius"]
                out = Path(own) / f"{name}.html"
                _, used = timed(PEERS[name], places, radius, out)
                print(f"  {name}: {out.stat().st_size / 1e6:.1f} MB in {used:.1f} s, positions alone")


if __name__ == "__main__":
    main()
