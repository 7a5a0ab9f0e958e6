#!/bin/sh
# Set up a virtual environment with the given extras on a bare machine: sh bootstrap.sh train,lab,dev
# With "base" there are none: everything but training by SAC and TD3 works.
set -eu
extras=$1
python=${PYTHON:-python3}
venv=${VENV:-.venv}
torch=2.13.0

say() { printf '\033[1m%s\033[0m\n' "$*"; }
stop() { printf '%s\n' "$*" >&2; exit 1; }
has() { command -v "$1" >/dev/null 2>&1; }

# Install Debian packages where that is permitted, else say the one line to run.
packages() {
    if ! has apt-get; then
        return 1
    elif [ "$(id -u)" = 0 ]; then
        apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$@" >/dev/null
    elif has sudo && sudo -n true 2>/dev/null; then
        sudo apt-get update -qq && sudo DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$@" >/dev/null
    else
        return 1
    fi
}

has "$python" || packages python3 python3-venv ||
    stop "Python is missing. Run: sudo apt-get install -y python3 python3-venv"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    stop "$("$python" --version) is too old. Run: make PYTHON=python3.11 (or newer)"

if [ ! -x "$venv/bin/python" ]; then
    say "Making $venv"
    if ! "$python" -m venv "$venv" >/dev/null 2>&1; then
        rm -rf "$venv"
        packages python3-venv || stop "venv is missing. Run: sudo apt-get install -y python3-venv"
        "$python" -m venv "$venv"
    fi
fi
pip() { "$venv/bin/python" -m pip --disable-pip-version-check install -q "$@"; }

case ",$extras," in *,train,*)
    if ! "$venv/bin/python" -c "import importlib.metadata as m, sys; sys.exit(not m.version('torch').startswith('$torch'))" 2>/dev/null; then
        say "Installing torch $torch for the CPU"
        # A plain `torch` on Linux brings gigabytes of CUDA; the CPU build is asked for by name first.
        pip "torch==$torch+cpu" 2>/dev/null ||
            pip "torch==$torch" --index-url https://download.pytorch.org/whl/cpu --retries 1 --timeout 10 2>/dev/null ||
            { say "No CPU build was found; taking the default one, which can be large"; pip "torch==$torch"; }
    fi
esac

# dm-control asks for labmaze, whose mazes nothing here enters. It has wheels up to Python 3.12, and
# not for every machine; elsewhere pip would ask for Bazel (github.com/google-deepmind/labmaze/issues/11).
if ! pip --only-binary labmaze labmaze 2>/dev/null; then
    say "labmaze has no build for this Python: an empty package stands in for it"
    empty=$(mktemp -d)
    printf '[project]\nname = "labmaze"\nversion = "0"\n' > "$empty/pyproject.toml"
    pip "$empty"
    rm -rf "$empty"
fi

say "Installing revolver_lab [$extras]"
case "$extras" in base) pip -e . ;; *) pip -e ".[$extras]" ;; esac

if [ "$(uname)" = Linux ] && ! ldconfig -p 2>/dev/null | grep -q 'libEGL_mesa\|libEGL_nvidia\|libOSMesa'; then
    say "Installing Mesa's EGL, to draw without a display"
    packages libegl1 libegl-mesa0 libgl1-mesa-dri ||
        say "No offscreen OpenGL here; everything but pictures works. To draw, run: sudo apt-get install -y libegl1 libegl-mesa0 libgl1-mesa-dri"
fi
for extra in base $(printf '%s' "$extras" | tr ',' ' '); do touch "$venv/ready-$extra"; done
