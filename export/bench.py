"""Times `fieldcam size` against the paper's own recipe on this machine, in one run.

`make bench`, or `python -m export.bench [--paper-iterations 32]`, runs each
contender in a process of its own, prints a Markdown table and writes the same
figures to export/.cache/bench.json. The paper's networks have random weights,
which costs the same time as trained ones. They take minutes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

# Nothing heavy is imported here: a child's peak memory starts at its parent's.
RENDERED = (Path("export/.cache/tuning"), Path("export/.cache/bench"))
RESULT = Path("export/.cache/bench.json")
PAPER_ITERATIONS = 32
CONTENDERS = {
    "default": "fieldcam size",
    "whole": "fieldcam size --whole-image",
    "paper-method": "fieldcam size --method paper",
    "sgbm-region": "fieldcam size --stereo sgbm",
    "sgbm-whole": "SGBM, whole image, 360 disparities",
    "mask-rcnn": "Mask R-CNN R50-FPN, torchvision",
    "raft-stereo": "RAFT-Stereo, published configuration, whole image",
}
PAPER = ("mask-rcnn", "raft-stereo")
SUMMED = ("median_ms", "worst_ms", "cpu_ms", "peak_mib")
STAGES = ("tags", "segmentation", "stereo")
FLAGS = {"AVX-512": "avx512f", "AVX-512 VNNI": "avx512_vnni", "AMX": "amx_tile"}
Json = dict[str, Any]


def machine() -> Json:
    """What the figures depend on."""
    words = Path("/proc/cpuinfo").read_text().splitlines()
    names = [line.split(":", 1)[1].strip() for line in words if line.startswith("model name")]
    flags = next((line.split() for line in words if line.startswith("flags")), [])
    return {
        "cpu": names[0] if names else "unknown",
        "cores": len(os.sched_getaffinity(0)),
        **{label: flag in flags for label, flag in FLAGS.items()},
        "load_before": os.getloadavg()[0],
        "at": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def measure(name: str, pair: Path, options: argparse.Namespace) -> Json:
    """One contender's figures, from its own process."""
    threads = str(options.threads)
    command = [sys.executable, "-W", "ignore", "-m", "export.bench_contenders", name, str(pair)]
    command += ["--repeats", str(options.repeats), "--threads", threads]
    command += ["--iterations", str(options.paper_iterations)]
    environment = os.environ | {"OMP_NUM_THREADS": threads}
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    found: Json = json.loads(done.stdout)
    return found | {"load_after": os.getloadavg()[0]}


def rendered_pair() -> Path:
    """A folder with a rendered pair; one is rendered where there is none."""
    for folder in RENDERED:
        if found := sorted(folder.glob("*/truth.json")):
            return found[0].parent
    command = [sys.executable, "-m", "export.render_orchard", "--out", str(RENDERED[-1])]
    subprocess.run([*command, "--seed", "6000001", "--blocks", "1", "--clusters", "1"], check=True)
    return next(RENDERED[-1].glob("*/truth.json")).parent


def report(result: Json) -> Iterator[str]:
    """The Markdown that is printed."""
    about = result["machine"]
    yield f"{about['cpu']}, {about['cores']} cores, {result['threads']} threads; " + ", ".join(
        f"{label}: {'yes' if about[label] else 'no'}" for label in FLAGS
    )
    yield (
        f"Load average {about['load_before']:.1f} before, {result['load_after']:.1f} after; "
        f"{about['at']}. All networks run in float32."
    )
    yield ""
    yield (
        "| ms, warm | " + " | ".join(STAGES) + " | rest | median | worst | CPU | first | peak MiB |"
    )
    yield "| --- |" + " ---: |" * (len(STAGES) + 6)
    measured = result["contenders"]
    for name, figures in measured.items():
        yield _row(CONTENDERS[name] + figures.get("note", ""), figures)
    if all(name in measured for name in PAPER):
        yield _row("**the paper's two networks**", _together([measured[n] for n in PAPER]))
    yield ""
    yield (
        "first: reads the pair, checks the networks' files, opens them and runs them once; "
        "imports are left out everywhere. CPU: of all threads together. Peak memory: of the "
        "whole process."
    )


def _row(label: str, figures: Json) -> str:
    stages = figures["stages_ms"]
    known = [stages.get(stage) for stage in STAGES]
    rest = figures["median_ms"] - sum(v for v in known if v is not None)
    values = [*known, rest, figures["median_ms"], figures["worst_ms"], figures["cpu_ms"]]
    values.append(figures.get("first_ms"))
    texts = ["" if value is None else f"{value:,.0f}" for value in values]
    return f"| {label} | " + " | ".join(texts) + f" | {figures['peak_mib']:,.0f} |"


def _together(parts: Sequence[Json]) -> Json:
    """Two processes side by side, as the authors run them, one after the other in time."""
    stages = {stage: ms for part in parts for stage, ms in part["stages_ms"].items()}
    summed = {key: sum(part[key] for part in parts) for key in SUMMED}
    return {"stages_ms": stages, **summed}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pair", type=Path, help="folder with left.png, right.png, calibration")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--paper-iterations", type=int, default=PAPER_ITERATIONS)
    parser.add_argument("--only", nargs="+", choices=CONTENDERS, default=list(CONTENDERS))
    options = parser.parse_args()
    result: Json = {"machine": machine(), "threads": options.threads, "contenders": {}}
    pair = options.pair or rendered_pair()
    for name in options.only:
        sys.stderr.write(f"bench: {CONTENDERS[name]}\n")
        result["contenders"][name] = measure(name, pair, options)
    result["load_after"] = os.getloadavg()[0]
    RESULT.parent.mkdir(parents=True, exist_ok=True)
    RESULT.write_text(json.dumps(result, indent=1) + "\n")
    sys.stdout.write("\n".join(report(result)) + "\n")


if __name__ == "__main__":
    main()
