"""Run every benchmark and write out/benchmarks.json: `python -m benchmarks [NAME ...]`."""

import argparse
import importlib
import json
import os
import platform
from importlib import metadata
from pathlib import Path

NAMES = ("evolution", "films", "importing", "lab", "natural", "population", "vector_env")


def machine() -> dict[str, object]:
    """What the ratios were measured on."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        cpu = lines[0].split(":")[1].strip() if lines else cpu
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("mujoco", "dm-control", "numpy", "gymnasium")},
    }


def main() -> None:
    """Run the benchmarks that are named, or all, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {NAMES}; all by default")
    parser.add_argument("-o", "--out", type=Path, default=Path("out/benchmarks.json"))
    args = parser.parse_args()
    if unknown := set(args.names) - set(NAMES):
        parser.error(f"no benchmark is called {sorted(unknown)}; there are {NAMES}")
    rows = []
    for name in args.names or NAMES:
        for row in importlib.import_module(f"benchmarks.{name}").run():
            rows.append(row)
            print(
                f"{row['work']} | {row['against']} | {row['ratio']} | aim {row['aim']}", flush=True
            )
            print(f"    {row['detail']}", flush=True)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    args.out.write_text(json.dumps({"machine": machine(), "rows": rows}, indent=2) + "\n")
    print(f"wrote {args.out}")


if __name__ == "__main__":
    main()
