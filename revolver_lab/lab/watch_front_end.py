"""Whether somebody looks on: widgets for those who do, a finished picture for those who do not."""

import os

LIVE = "REVOLVER_LAB_LIVE"
"""Environment variable: 1 shows widgets and 0 a picture, whatever the front end seems to be."""


def somebody_looks() -> bool:
    """Says whether a front end shows what this cell returns, and will answer to its widgets.

    A kernel is told with each cell whether it may ask for input: JupyterLab, the classic
    notebook, VS Code and Colab allow it, as somebody is there to answer; nbclient, on which
    nbmake, nbconvert and papermill are built, does not.
    """
    told = os.environ.get(LIVE, "")
    if told in ("0", "1"):
        return told == "1"
    try:
        from IPython.core.getipython import get_ipython
    except ImportError:
        return False
    kernel = getattr(get_ipython(), "kernel", None)
    if kernel is None:
        return False
    return bool(kernel.get_parent("shell").get("content", {}).get("allow_stdin", False))
