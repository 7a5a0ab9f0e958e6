"""Speed as ratios, each against a named peer or bound in the same run: `python -m benchmarks`."""
