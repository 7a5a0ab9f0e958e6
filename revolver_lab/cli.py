"""The command line `revolver-lab`: errors in one line, interruptions too."""

import importlib
import sys
from collections.abc import Sequence

import revolver_lab as rvl
from revolver_lab import _gl, _versions
from revolver_lab.commands.parser import make_parser
from revolver_lab.errors import RevolverError

BAD_USE = 2
"""Exit code after an error that the user can mend; argparse uses it too."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: Words after `revolver-lab`; by default those of the shell.

    Returns:
        0, or 2 after an error, which is one line on stderr.

    Example:
        >>> main(["list", "--short"])
        cheetah-front-leg
        ...
        0
    """
    arguments = make_parser(rvl.__doc__, rvl.__version__).parse_args(argv)
    module, _, function = arguments.run.partition(":")
    try:
        if function != "doctor":
            _versions.check()
            _gl.choose()
        run = getattr(importlib.import_module(f"revolver_lab.commands.{module}"), function)
        return run(arguments)
    except BrokenPipeError:  # the reader had enough, as `| head` does
        sys.stderr.close()
        return 0
    except (RevolverError, OSError) as problem:
        print(f"revolver-lab: {' '.join(str(problem).split())}", file=sys.stderr)
    except KeyboardInterrupt:
        print("revolver-lab: stopped", file=sys.stderr)
    return BAD_USE


if __name__ == "__main__":
    sys.exit(main())
