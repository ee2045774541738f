"""Environments in which tisim is tested: how each is set up, and the expected outcome.

A script is run by bash in a fresh folder with ``tiny.toml``, ``law.py`` and the scripts below. $TISIM is the
command, $RUN runs tiny.toml into ``out``, $PYTHON is Python, $SITE the value of PYTHONPATH.
"""

from __future__ import annotations

from dataclasses import dataclass

SCENE = """
duration = 0.02
[particles]
kind = "particles"
position = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
velocity = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
radius = [1e-3, 1e-3]
density = 2000.0
[stepper]
kind = "verlet"
control = {kind = "fixed_step", dt = 1e-3}
[effects.gravity]
"""
WORK = """
import os, sys, threading, time
import multiprocessing
import tisim

fork = multiprocessing.get_context("fork")

def work(steps=20):
    scene = tisim.Scene.from_toml("tiny.toml").replace({"duration": 1e-3 * steps})
    return tisim.run(scene).state["position"][0, 0].round(6)

def refused():
    try:
        return work()
    except tisim.RunError as refusal:
        return str(refusal)

def child(leave):
    number = os.fork()
    if not number:
        print(refused(), flush=True)
        leave()
    ends = time.monotonic() + 60
    while time.monotonic() < ends:
        done, status = os.waitpid(number, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.02)
    os.kill(number, 9)
    return "hung"
"""
"""The common part of Python scripts: a run, which ends at 0.02 m, and forked processes."""


@dataclass(frozen=True)
class Environment:
    """An environment.

    script : for bash. code : its exit code. result : True if out/result.h5 must equal the result of a plain
    run bit for bit, False if it must be absent, None for no check. says, prints : patterns to be found in
    standard error and output; if ``says`` is None, standard error must have only the progress bar. quick :
    whether the environment is part of the quick tests.
    """

    group: str
    name: str
    script: str
    code: int = 0
    result: bool | None = True
    says: str | None = None
    prints: str = ""
    quick: bool = False


def python(text: str, how: str = "$PYTHON script.py") -> str:
    """A bash script that runs a Python script."""
    return f"cat > script.py <<'END'\n{WORK}\nif __name__ == '__main__':\n    {text}\nEND\n{how}"


NO_HOME = "unset HOME XDG_CACHE_HOME;"
BAD_HOME = "unset XDG_CACHE_HOME; export HOME=/dev/null/x MPLCONFIGDIR=$PWD;"
KERNELS = "compiled kernels are not kept for the next process: /dev/null/x"
FULL = "^standard output could not be written: No space left on device$"
CLOSED = "<&- >&- 2>&-"
ASCII = "LC_ALL=C PYTHONCOERCECLOCALE=0 PYTHONUTF8=0"
SPAWN = r"tisim has been started in the process that this one was forked from.*get_context\('spawn'\)"
NO_PICTURE = "out/cloud.png could not be drawn: .*The picture is left out; the data are written"
FRAMES = "$PYTHON -c \"import tisim; assert len(tisim.read('out/trajectory.h5').times) == 3\""
ALL_AT_ONCE = (
    f'env -i PATH="$PATH" PYTHONPATH="$SITE" LC_ALL=xx_YY PYTHONUTF8=0 TMPDIR=/dev/null/x '
    "MPLBACKEND=nonsense TI_ARCH=nonsense TI_LOG_LEVEL=nonsense TI_ENABLE_PYBUF=x QD_DEBUG=maybe "
    f"TISIM_BACKEND={{}} $RUN {CLOSED}"
)

COST = "$TISIM cost tiny.toml --quick --anyway --no-f32 --no-fast --out k"
BROKEN = 'mkdir m; echo \'raise RuntimeError("broken")\' > m/matplotlib.py; export PYTHONPATH="$PWD/m:$SITE";'
DRAWN = "[ -s out/cloud.png ]"

FOLDERS = (
    ("HOME unset", f"{NO_HOME} $RUN"),
    ("HOME unset, quadrants", f"{NO_HOME} TISIM_BACKEND=quadrants $RUN"),
    ("no variables at all", 'env -i PATH="$PATH" PYTHONPATH="$SITE" $RUN'),
    ("HOME empty", f"{NO_HOME} HOME= $RUN"),
    ("HOME relative", f"{NO_HOME} HOME=here $RUN"),
    ("HOME not made yet", "HOME=$PWD/new $RUN"),
    ("HOME cannot be made", f"{BAD_HOME} $RUN", {"says": KERNELS}),
    ("HOME cannot be made, quadrants", f"{BAD_HOME} TISIM_BACKEND=quadrants $RUN", {"says": KERNELS}),
    ("XDG_CACHE_HOME empty, no HOME", f"{NO_HOME} XDG_CACHE_HOME= $RUN"),
    ("XDG_CACHE_HOME cannot be made", "export XDG_CACHE_HOME=/dev/null/x MPLCONFIGDIR=$PWD; $RUN",
     {"says": KERNELS}),
    ("TMPDIR missing", "TMPDIR=/nowhere $RUN"),
    ("HOME and TMPDIR cannot be made", f"{BAD_HOME} TMPDIR=/dev/null/t $RUN", {"says": KERNELS}),
    ("working folder removed", 'W=$PWD; mkdir d; cd d; rmdir ../d; $TISIM run $W/tiny.toml --out $W/out'),
    ("working folder removed, relative paths", "W=$PWD; mkdir d; cd d; rmdir ../d; $TISIM run $W/tiny.toml",
     {"code": 2, "result": False, "says": "^output folder must be writable"}),
    ("output folder cannot be made", "$TISIM run tiny.toml --out /proc/x",
     {"code": 2, "result": False, "says": "^output folder must be writable; received '/proc/x'"}),
    # A user who may write everywhere, such as root, has no such folder.
    ("output folder read-only", "mkdir out; chmod a-w out; $RUN; [ $? = 2 -o -w out ] && chmod u+w out && "
     "{ [ -e out/result.h5 ] || $RUN; }", {"says": ""}),
    ("output folder removed while it runs", python(
        "from tisim.io import run_folder; import shutil; from tisim.cli.main import main\n"
        "    write = run_folder.write\n"
        "    run_folder.write = lambda *a: (shutil.rmtree('out'), write(*a))[1]\n"
        "    main('run tiny.toml --threads 1 --out out'.split())")),
)  # fmt: skip
STREAMS = (
    ("output closed", "$RUN >&-"),
    ("error closed", "$RUN 2>&-"),
    ("input closed", "$RUN <&-"),
    ("all three closed", f"$RUN {CLOSED}"),
    ("all three closed, with frames", f"$RUN --frames 2 {CLOSED} && {FRAMES}"),
    ("output full", "$RUN > /dev/full", {"says": FULL, "quick": True}),
    ("error full", "$RUN 2> /dev/full"),
    ("output and error full", "$RUN > /dev/full 2> /dev/full"),
    ("reader of the output gone", "$RUN | true"),
    ("reader of the error gone", "$RUN 2> >(true)"),
    ("reader leaves after a line", "$RUN | head -1", {"prints": "^status +ok"}),
    *((f"{command}: output full", f"$TISIM {command} > /dev/full", {"code": 1, "result": None, "says": FULL})
      for command in ("effects", "cases", "--help", "--version", "explain tiny.toml", "doctor",
                      "check vibration")),
    *((f"{command}: all three closed", f"$TISIM {command} {CLOSED}", {"result": None})
      for command in ("effects", "cases", "--help", "explain tiny.toml", "doctor")),
    *((f"{command}: reader gone", f"$TISIM {command} | true", {"result": None})
      for command in ("effects", "effects gravity", "cases", "explain tiny.toml")),
    ("wrong input, all three closed", f"$TISIM run nowhere.toml {CLOSED}", {"code": 2, "result": None}),
    *((f"{command}: output full, files there",
       f"$RUN --frames 2 && $TISIM {command} > /dev/full && [ -s {file} ]", {"says": FULL})
      for command, file in (("plot out", "out/time_series.png"), ("movie out", "out/trajectory.gif"),
                            ("export out", "out/trajectory.pvd"))),
    ("optimize: all three closed", f"$TISIM optimize my_drift.py --out s {CLOSED} && [ -s s/best.csv -a -s "
     "s/convergence.png ]", {"result": None}),
    ("optimize: output and error full", "$TISIM optimize my_drift.py --out s >/dev/full 2>/dev/full && "
     "[ -s s/best.csv -a -s s/convergence.png ]", {"result": None}),
    ("compare: output full", "$TISIM compare my_drift.py --methods random --evaluations 8 --repeats 2 "
     "--fresh-starts 2 --out c >/dev/full && [ -s c/compare.csv ]", {"result": None, "says": FULL}),
    ("cost: all three closed", f"{COST} {CLOSED} && [ -s k/cost.csv -a -s k/cost.png ]", {"result": None}),
    ("cost: output full", f"{COST} >/dev/full && [ -s k/cost.csv -a -s k/cost.png ]",
     {"result": None, "says": FULL}),
    ("new: output full", "$TISIM new effect pull > /dev/full; code=$?; ls *pull*.py && exit $code",
     {"result": None, "says": FULL, "prints": "pull.py"}),
)  # fmt: skip
TEXTS = (
    ("ASCII by LC_ALL=C", f"{ASCII} $RUN"),
    ("ASCII by PYTHONIOENCODING", "PYTHONIOENCODING=ascii:strict $RUN"),
    ("ASCII: explain", f"{ASCII} $TISIM explain tiny.toml", {"result": None, "says": ""}),
    ("ASCII: effects", f"{ASCII} $TISIM effects > list && ! LC_ALL=C grep '[^ -~]' list", {"result": None}),
    ("ASCII: export",
     f"$RUN --frames 2 && {ASCII} $TISIM export out --format xyz && [ -s out/trajectory.xyz ]"),
    ("ASCII, scene in a folder with an umlaut",
     f"mkdir Zürich; cp tiny.toml Zürich; {ASCII} $TISIM run Zürich/tiny.toml --out out"),
    ("ASCII, output folder with an umlaut", f"{ASCII} $TISIM run tiny.toml --out Zürich",
     {"code": 2, "result": False, "says": "^path must be a valid name of a file or folder"}),
    ("locale that is not known", "LC_ALL=xx_YY $RUN"),
    ("name of a scene with escapes", "printf 'name = \"\\\\u001b[31mRED\"\\n' | cat - tiny.toml > red.toml; "
     "! $TISIM explain red.toml | grep $'\\x1b'", {"result": None, "says": ""}),
    ("terminal unknown", "TERM=nonsense COLUMNS=x LINES=y $RUN"),
    ("terminal of one column", "COLUMNS=1 $RUN", {"says": ""}),
)  # fmt: skip
VARIABLES = (
    *((f"TI_{setting}", f"TISIM_BACKEND=taichi TI_{setting} $RUN", {"prints": "^device +cpu, f64, strict"})
      for setting in ("ARCH=nonsense", "ARCH=cuda", "LOG_LEVEL=nonsense", "DEBUG=maybe", "DEFAULT_FP=32",
                      "CPU_MAX_NUM_THREADS=x", "OFFLINE_CACHE=x", "ENABLE_PYBUF=x", "RANDOM_SEED=x",
                      "ADVANCED_OPTIMIZATION=x", "PRINT_IR=1", "LIB_DIR=/nowhere")),
    *((f"QD_{setting}", f"TISIM_BACKEND=quadrants QD_{setting} $RUN", {"prints": "^device +cpu, f64, strict"})
      for setting in ("ARCH=nonsense", "ARCH=cuda", "LOG_LEVEL=nonsense", "DEBUG=maybe", "LOAD_IR=1",
                      "ENABLE_PYBUF=x", "KERNEL_COVERAGE=1", "COVERAGE_MAX_PROBES=x")),
    ("TI_OFFLINE_CACHE_FILE_PATH cannot be made",
     "TISIM_BACKEND=taichi TI_OFFLINE_CACHE_FILE_PATH=/dev/null/x $RUN", {"says": KERNELS}),
    ("TISIM_BACKEND unknown", "TISIM_BACKEND=numba $RUN",
     {"code": 2, "result": False, "says": "^TISIM_BACKEND must be"}),
    ("TISIM_CHECKPOINT_SECONDS no number", "TISIM_CHECKPOINT_SECONDS=x $RUN",
     {"code": 2, "result": False, "says": "^TISIM_CHECKPOINT_SECONDS must be"}),
    ("PYTHONOPTIMIZE=2", "PYTHONOPTIMIZE=2 $RUN"),
    ("warnings are errors", "PYTHONWARNINGS=error $RUN"),
    ("threads of other libraries", "OMP_NUM_THREADS=x OPENBLAS_NUM_THREADS=x $RUN", {"says": ""}),
    ("all at once", ALL_AT_ONCE.format("taichi"), {"quick": True}),
    ("all at once, quadrants", ALL_AT_ONCE.format("quadrants")),
)  # fmt: skip
PICTURES = (
    ("backend of a notebook", f"MPLBACKEND=module://matplotlib_inline.backend_inline $RUN && {DRAWN}"),
    ("backend unknown", f"MPLBACKEND=nonsense $RUN && {DRAWN}"),
    ("backend with a window", f"MPLBACKEND=TkAgg $RUN && {DRAWN}"),
    ("backend unknown: other commands", f"export MPLBACKEND=nonsense; $RUN --frames 2 && $TISIM plot out && "
     f"$TISIM movie out && $TISIM optimize my_drift.py --out s && {COST} && [ -s out/time_series.png -a "
     "-s out/trajectory.gif -a -s s/convergence.png -a -s k/cost.png ]", {"says": ""}),
    ("matplotlibrc unreadable", "printf 'lines.color: \\xff' > matplotlibrc; $RUN", {"says": ""}),
    ("matplotlibrc asks for TeX", "echo 'text.usetex: True' > matplotlibrc; PATH= $RUN", {"says": ""}),
    ("fonts missing", "printf 'font.family: none\\nfont.sans-serif: none' > matplotlibrc; $RUN",
     {"says": ""}),
    ("matplotlib broken", f"{BROKEN} $RUN", {"says": NO_PICTURE, "quick": True}),
    ("matplotlib broken: plot", f"$RUN; {BROKEN} $TISIM plot out",
     {"code": 1, "says": "could not be drawn: RuntimeError: broken$"}),
    ("matplotlib broken: movie", f"$RUN --frames 2; {BROKEN} $TISIM movie out",
     {"code": 1, "says": "could not be drawn: RuntimeError: broken$"}),
    ("matplotlib broken: optimize", f"{BROKEN} $TISIM optimize my_drift.py --out s && [ -s s/best.csv ]",
     {"result": None, "says": "The picture is left out; the data are written"}),
    ("matplotlib broken: cost", f"{BROKEN} {COST} && [ -s k/cost.csv -a -s k/cost.h5 ]",
     {"result": None, "says": "The picture is left out; the data are written"}),
    ("matplotlib broken: figures", f"{BROKEN} $TISIM figures valve",
     {"code": 1, "result": None, "says": "^figures of valve could not be drawn: RuntimeError: broken$"}),
)  # fmt: skip
LIMITS = (
    ("address space of 1.5 GB", "ulimit -v 1500000; $RUN",
     {"code": 1, "result": False, "says": "^memory must be enough"}),
    ("address space of 0.5 GB", "ulimit -v 500000; $RUN",
     {"code": 1, "result": False, "says": "^memory must be enough", "quick": True}),
    ("16 open files", "ulimit -n 16; $RUN", {"says": ""}),
    ("stack of 256 kB", "ulimit -s 256; $RUN"),
    ("one process", "ulimit -u 1; $RUN", {"says": ""}),
    ("files of 4 kB", "ulimit -f 4; $RUN",
     {"code": 1, "result": False, "says": "could not be written: File too large"}),
    ("files of 4 kB, then none", "(ulimit -f 4; $RUN); [ $? = 1 ] && $RUN", {"says": "File too large"}),
    *((f"kernels cut at 4 kB, then used, {backend}", f"export TISIM_BACKEND={backend} {prefix}_OFFLINE_CACHE_"
       "FILE_PATH=$PWD/k; (ulimit -f 4; $RUN); [ $? = 1 ] && $RUN", {"says": ""})
      for backend, prefix in (("taichi", "TI"), ("quadrants", "QD"))),
    ("killed before the first checkpoint, then again", "$RUN --frames 2 --set duration=1e6 & "
     "while [ ! -e out/trajectory.h5 ] && kill -0 $!; do sleep 0.1; done; kill -9 $!; wait $!; "
     "TISIM_CHECKPOINT_SECONDS=0 $RUN --frames 2 --set duration=1e6 & "
     "while [ ! -e out/checkpoint.h5 ] && kill -0 $!; do sleep 0.1; done; kill $!; wait $!",
     {"code": 143, "result": False, "says": "To go on, give the same command again"}),
)  # fmt: skip
PYTHONS = (
    ("python -", "$PYTHON - < script.py", {"prints": "^0.02$"}),
    ("python -c", '$PYTHON -c "$(cat script.py)"', {"prints": "^0.02$"}),
    ("a loop of asyncio", "import asyncio\n    async def main(): print(work())\n    asyncio.run(main())"),
    ("output without a file", "import types\n    text = []\n"
     "    sys.stdout = sys.stderr = types.SimpleNamespace(write=text.append)\n"
     "    from tisim import optimize; import my_drift\n"
     "    optimize.run(my_drift.PROBLEM, verbose=True, out='s', **my_drift.SEARCH)\n"
     "    sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__\n"
     "    assert any('written' in t for t in text); print(work())"),
    ("no output at all", "show = os.dup(1); sys.stdout = sys.stderr = None\n"
     "    from tisim import optimize; import my_drift\n"
     "    optimize.run(my_drift.PROBLEM, verbose=True, **my_drift.SEARCH)\n"
     "    os.write(show, f'{work()}\\n'.encode())"),
    ("four threads", "from concurrent.futures import ThreadPoolExecutor\n"
     "    print(*set(ThreadPoolExecutor(4).map(work, [20] * 8)))"),
    ("forked before the first run", "print(*set(fork.Pool(2).map(work, [20, 20])))"),
    ("forked by hand before the first run", "assert child(lambda: os._exit(0)) == 0; print(work())"),
    ("forked by a pool after a run", "print(work()); print(fork.Pool(1).apply_async(refused).get(60))",
     {"prints": SPAWN}),
    ("forked by an executor after a run", "from concurrent.futures import ProcessPoolExecutor\n"
     "    print(work()); print(ProcessPoolExecutor(1, fork).submit(refused).result(60))", {"prints": SPAWN}),
    ("forked by hand after a run", "print(work()); assert child(sys.exit) == 0; print(work())",
     {"prints": SPAWN}),
    ("forked by hand after a run, quadrants", "print(work()); assert child(sys.exit) == 0; print(work())",
     {"prints": SPAWN}),
    ("forked after a run, to read", "tisim.run(tisim.Scene.from_toml('tiny.toml'), "
     "record=tisim.Recording('t.h5', frames=2))\n"
     "    print(len(fork.Pool(1).apply_async(tisim.read, ['t.h5']).get(60).times)); print(work())"),
    ("spawned after a run", "work(); print(multiprocessing.get_context('spawn').Pool(1).apply(work))"),
    ("forked while a trajectory is written", "scene, forked = tisim.Scene.from_toml('tiny.toml'), []\n"
     "    def progress(fraction):\n"
     "        if not forked:\n"
     "            forked.append(child(sys.exit)) \n"
     "    tisim.run(scene, progress, record=tisim.Recording('t.h5', frames=2))\n"
     "    assert forked == [0] and len(tisim.read('t.h5').times) == 3; print(work())"),
)  # fmt: skip


def _rows(group: str, rows: tuple[tuple, ...]) -> list[Environment]:
    return [Environment(group, row[0], row[1], **(row[2] if len(row) > 2 else {})) for row in rows]


def _python_rows() -> list[Environment]:
    """Python scripts print the position at the end of the run, and leave nothing in ``out``."""
    made = []
    for name, text, *more in PYTHONS:
        stands_in = text.startswith("$PYTHON")
        script = python("print(work())", text) if stands_in else python(text)
        backend = "export TISIM_BACKEND=quadrants\n" if name.endswith("quadrants") else ""
        # Python may warn of the fork itself.
        settings = {"result": None, "prints": "^0.02$", "says": "", **(more[0] if more else {})}
        made.append(Environment("python", name, backend + script, **settings))
    return made


ENVIRONMENTS = [
    *_rows("folders", FOLDERS), *_rows("streams", STREAMS), *_rows("text", TEXTS),
    *_rows("variables", VARIABLES), *_rows("pictures", PICTURES), *_rows("limits", LIMITS), *_python_rows(),
]  # fmt: skip
