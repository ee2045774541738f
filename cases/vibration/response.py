"""The centre of gravity of the case vibration: its sweep over drive frequencies, its beats and its spectrum.

Z13 shows eight drive frequencies Omega, over w = q B/m. Here any number of them runs as the worlds of one
batch, each with an operator that records the largest displacement. With a tether along x and y there are two
resonances, sqrt(w^2/4 + k/m) +- w/2. The fast one is that in Z13's figure 3(e). The slow one is a drift about
the anchor with a period of 12.6 s, for which Z13's runs are far too short.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.signal.windows import blackmanharris

from tisim import Recording, Scene, run
from tisim.cases.common.runs import sound
from tisim.cases.vibration import scene as vibration
from tisim.cases.vibration.closed_forms import resonances, response
from tisim.cases.vibration.scene import CHARGE, CYCLOTRON, FIELD, MASS, STIFFNESS
from tisim.engine.batches import Progress
from tisim.io.reader import Frames, frames
from tisim.plotting.time_series import history
from tisim.sources import ElectricField

SLOW, FAST = resonances(CYCLOTRON, STIFFNESS / MASS)
"""The two resonances of the paper's particles, 1/s: 0.49974 and 955.429."""
BEAT_DRIVE = 0.9
"""The drive frequency of the beats divided by the fast resonance; the beat frequency |Omega - FAST| is a
tenth of it."""


def peak(t_end: float, w: float, k_m: float, push: float, omega: float) -> float:
    """Return the largest |x + i y| (m) of the closed form up to a time, s.

    It is sampled 160 times per circle, with an error of at most 2e-4 of the radius, but at most 200,000
    times: in runs longer than that, the circles are far smaller than the drift.
    """
    circles = max(omega, resonances(w, k_m)[1]) * t_end / (2 * np.pi)
    times = np.linspace(0.0, t_end, min(256 + int(160 * circles), 200_000))
    return float(np.abs(response(times, w, k_m, push, omega)).max())


@dataclass(frozen=True)
class Sweep:
    """Largest displacements (m) within a duration (s) at drive frequencies (1/s): as run, and in closed
    form."""

    duration: float
    omega: np.ndarray
    peaks: np.ndarray
    exact: np.ndarray

    @classmethod
    def of(cls, scenes: Sequence[Scene], progress: Progress | None = None) -> Sweep:
        """Run scenes with the operator PeakDisplacement that differ only in their drive frequency."""
        results = sound(run(scenes, progress))
        omega = np.array([drive(scene) for scene in scenes])
        duration = scenes[0].duration
        exact = [peak(duration, CYCLOTRON, STIFFNESS / MASS, CHARGE * FIELD / MASS, o) for o in omega]
        peaks = np.array([result.measures["peak_displacement"] for result in results])
        return cls(duration, omega, peaks, np.array(exact))

    @property
    def deviation(self) -> float:
        """Return the largest relative difference between run and closed form."""
        return float(np.abs(self.peaks / self.exact - 1).max())

    def top(self, above: float = 0.0) -> float:
        """Return the drive frequency (1/s) of the largest response as run, from a parabola through three
        points.

        The points are the largest response and its two neighbours.
        """
        k = int(np.where(self.omega > above, self.peaks, 0.0)[:-1].argmax())
        return vertex(self.omega[k - 1 : k + 2], self.peaks[k - 1 : k + 2])


def drive(scene: Scene) -> float:
    """Return Omega of a scene of the case, 1/s."""
    return next(effect.omega[0] for effect in scene.effects if isinstance(effect, ElectricField))


def vertex(x: np.ndarray, y: np.ndarray) -> float:
    """Return the position of the maximum of a parabola through three points."""
    a, b, _ = np.polyfit(x - x[1], y, 2)
    return float(x[1] - b / (2 * a))


def fast_scenes(ratios: Iterable[float], near_field: str = "none", sites: int = 1) -> list[Scene]:
    """Return scenes around the fast resonance: 0.1 s, 15 of its periods."""
    error = 1e-6 if sites == 1 else 1e-5
    return [vibration.scene(r, near_field, 0.1, sites, error, observed=True) for r in ratios]


def slow_scenes(omega: Iterable[float]) -> list[Scene]:
    """Return scenes around the slow resonance: 60 s, 5 of its periods, in which a particle moves through 9000
    circles.

    A step is a seventh of a circle, so that circles are not resolved; the drift has errors of 1e-6.
    """
    return [vibration.scene(o / CYCLOTRON, "none", 60.0, 1, 1e-2, longest=1e-3, observed=True) for o in omega]


@dataclass(frozen=True)
class CentreOfGravityHistory:
    """The centre of gravity at equally spaced times (s): position z = x + i y (m), velocity (m/s)."""

    time: np.ndarray
    place: np.ndarray
    velocity: np.ndarray

    @classmethod
    def of(cls, trajectory: Frames) -> CentreOfGravityHistory:
        """Return the history of a trajectory at equally spaced times.

        Between frames it is the cubic interpolation of positions and velocities.
        """
        series = history(trajectory)
        x, v = (a[:, 0] + 1j * a[:, 1] for a in (series.shift, series.drift))
        even = np.linspace(series.time[0], series.time[-1], len(series.time))
        k = np.clip(np.searchsorted(series.time, even, side="right") - 1, 0, len(even) - 2)
        h = np.diff(series.time)[k]
        u = (even - series.time[k]) / h
        # Hermite's cubic, and its derivative.
        p0, p1, m0, m1 = x[k], x[k + 1], h * v[k], h * v[k + 1]
        place = p0 + u * m0 + u**2 * (3 * (p1 - p0) - 2 * m0 - m1) + u**3 * (2 * (p0 - p1) + m0 + m1)
        slope = m0 + 2 * u * (3 * (p1 - p0) - 2 * m0 - m1) + 3 * u**2 * (2 * (p0 - p1) + m0 + m1)
        return cls(even, place, slope / h)

    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Return angular frequencies (1/s, both signs: the sense of rotation) and amplitudes (m) of the
        position.

        They are |FFT| with the window of Blackman and Harris, whose side lobes are below 3e-5 of a line. A
        line of amplitude A has the height A. The series is padded with zeros to make the curve smooth.
        """
        window = blackmanharris(len(self.time), sym=False)
        n = 8 * len(window)
        lines = np.abs(np.fft.fft(self.place * window, n)) / window.sum()
        omega = 2 * np.pi * np.fft.fftfreq(n, self.time[1] - self.time[0])
        order = np.argsort(omega)
        return omega[order], lines[order]

    def beat_period(self) -> float:
        """Return the beat period of the speed, s.

        The square of the speed is A^2 + B^2 - 2 A B cos(|Omega - omega| t) for two circles. The period is
        taken from the highest line of its spectrum below half of the fast resonance.
        """
        power = np.abs(self.velocity) ** 2
        n = 16 * len(power)
        lines = np.abs(np.fft.rfft((power - power.mean()) * np.hanning(len(power)), n))
        omega = 2 * np.pi * np.fft.rfftfreq(n, self.time[1] - self.time[0])
        k = int(np.where(omega < FAST / 2, lines, 0.0).argmax())
        return 2 * np.pi / vertex(omega[k - 1 : k + 2], lines[k - 1 : k + 2])


def beats(periods: float = 6.0, frames_a_period: int = 20) -> CentreOfGravityHistory:
    """Return the history of one particle that is driven at BEAT_DRIVE times the fast resonance for several
    beats."""
    duration = periods * 2 * np.pi / (FAST * (1 - BEAT_DRIVE))
    driven = vibration.scene(BEAT_DRIVE * FAST / CYCLOTRON, "none", duration, sites=1, observed=True)
    count = int(frames_a_period * duration * FAST / (2 * np.pi))
    return recorded([driven], count)[0]


def recorded(
    scenes: Sequence[Scene], count: int, progress: Progress | None = None
) -> list[CentreOfGravityHistory]:
    """Run scenes as one batch, and return their histories from ``count`` frames each."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "trajectory.h5"
        sound(run(list(scenes), progress, Recording(path, frames=count)))
        histories = []
        for world in range(len(scenes)):
            with frames(path, world) as trajectory:
                histories.append(CentreOfGravityHistory.of(trajectory))
        return histories
