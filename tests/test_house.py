"""House rules: imports point one way, the package is light, what is public is documented."""

import ast
import importlib
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import revolver_lab as rvl

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "revolver_lab"
# Bottom first: a module imports from its own layer and from those before it, never from above.
LAYERS = [
    ["errors", "given", "_gl", "_versions", "files"],
    ["stats"],
    ["evolution"],
    ["tasks"],
    ["robots"],
    ["envs"],
    ["weights", "cards", "lifting", "actors", "policies"],
    ["shaping", "theory", "schedule", "methods", "gates"],
    ["trajectories", "demonstrations", "demonstration_sources"],
    ["learners"],
    ["evaluation", "logs", "natural_log", "recorder", "progress"],
    ["algorithm1", "natural_loop", "natural_methods"],
    ["preflight"],
    ["population", "natural_population"],
    ["transferring", "natural_transfer"],
    ["experts"],
    ["runs"],
    ["exercises"],
    ["lab"],
    ["commands"],
    ["demos", "cli"],
]
LEVEL = {name: level for level, layer in enumerate(LAYERS) for name in layer}
MODULES = sorted(p for p in PACKAGE.rglob("*.py") if p != PACKAGE / "__init__.py")
HEAVY_HOMES = {
    "torch": {"learners"},
    "stable_baselines3": {"learners"},
    "matplotlib": {"lab"},
    "mediapy": {"lab"},
    "ipywidgets": {"lab"},
}


def _module(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def _imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_point_one_way(path):
    ours = _module(path)
    assert ours in LEVEL, f"{ours} has no layer: give it one in LAYERS"
    for name in _imports(path):
        if name.startswith("revolver_lab.") and name.count("."):
            other = name.split(".")[1]
            if other in LEVEL:
                assert LEVEL[other] <= LEVEL[ours], f"{ours} imports {other}, which is above it"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_heavy_libraries_stay_where_they_belong(path):
    for name in _imports(path):
        homes = HEAVY_HOMES.get(name.split(".")[0])
        assert homes is None or _module(path) in homes, f"{name} in {path.name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_file_is_one_idea_with_short_functions(path):
    text = path.read_text()
    tree = ast.parse(text)
    assert ast.get_docstring(tree), "no module docstring"
    assert "\n\n" not in ast.get_docstring(tree).strip(), "the module docstring is one sentence"
    assert text.count("\n") <= 250
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            doc = ast.get_docstring(node, clean=False)
            lines = node.end_lineno - node.lineno + 1 - (len(doc.split("\n")) if doc else 0)
            assert lines <= 40, f"{node.name} has {lines} lines"
        assert not isinstance(node, ast.Assert), "an assert is no answer to a user"
        assert not (isinstance(node, ast.ExceptHandler) and node.type is None), "bare except"


def _run(code: str) -> str:
    env = {k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=env, cwd=ROOT
    )
    return done.stdout.strip()


def test_importing_the_package_touches_no_torch_no_gl_and_no_file():
    code = (
        "import sys, builtins, os; before = set(sys.modules); opened = []\n"
        "sys.addaudithook(lambda e, a: opened.append(a[0]) if e == 'open' else None)\n"
        "import revolver_lab\n"
        "new = {m.split('.')[0] for m in set(sys.modules) - before}\n"
        "print(sorted(new & {'torch', 'OpenGL', 'glfw', 'dm_control', 'mujoco', 'matplotlib',"
        " 'mediapy', 'ipywidgets', 'stable_baselines3'}))\n"
        "print([f for f in opened if not str(f).endswith(('.py', '.pyc'))])\n"
        "print('MUJOCO_GL' in os.environ)"
    )
    assert _run(code).splitlines() == ["[]", "[]", "False"]


@pytest.mark.parametrize("order", ["gymnasium, revolver_lab", "revolver_lab, gymnasium"])
def test_gymnasium_knows_every_robot_once_the_package_is_imported(order):
    code = (
        f"import {order}\n"
        "env = gymnasium.make('revolver_lab/CheetahFrontLeg-v0', alpha=0.3)\n"
        "print(env.reset(seed=0)[0].shape[0] == env.observation_space.shape[0])"
    )
    assert _run(code) == "True"


def test_a_robot_can_be_made_and_moved_without_torch():
    code = (
        "import sys; sys.modules['torch'] = None; sys.modules['stable_baselines3'] = None\n"
        "import revolver_lab as rvl; evolve = rvl.load('cheetah-front-leg')\n"
        "evolve.set_alpha(evolve(0.2), 0.4); print(evolve.model(0.5).nbody)"
    )
    assert _run(code) == "8"


@pytest.mark.parametrize("name", rvl.__all__)
def test_every_public_name_exists_and_is_documented(name):
    value = getattr(rvl, name)
    assert inspect.getdoc(value)
    assert importlib.import_module(rvl._PUBLIC[name])


def test_public_names_survive_the_import_of_any_module():
    code = (
        "import revolver_lab as rvl, importlib\n"
        "for m in set(rvl._PUBLIC.values()): importlib.import_module(m)\n"
        "print([n for n in rvl.__all__ if n not in rvl._MODULES and not callable(getattr(rvl, n))])"
    )
    assert _run(code) == "[]"


def test_there_are_few_public_names_and_each_has_its_place():
    assert set(rvl.__all__) == set(rvl._PUBLIC)
    assert len(rvl.__all__) <= 15


def test_an_unknown_public_name_lists_the_known_ones():
    with pytest.raises(AttributeError, match="Evolution"):
        rvl.Evolutions  # noqa: B018


def test_almost_every_public_function_is_documented_and_every_parameter_typed():
    public, documented, parameters, typed = 0, 0, 0, 0
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                if not node.name.startswith("_"):
                    public += 1
                    documented += ast.get_docstring(node) is not None
                arguments = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
                named = [a for a in arguments if a.arg not in ("self", "cls")]
                parameters += len(named)
                typed += sum(a.annotation is not None for a in named)
    assert documented >= 0.9 * public
    assert typed >= 0.98 * parameters


def test_the_notation_reserves_its_names():
    # alpha means evolution: no learner may call a temperature or a step so.
    for path in MODULES:
        if _module(path) == "learners":
            assert not re.search(r"\b(log_alpha|alpha_loss|alpha_lr)\b", path.read_text())


@pytest.mark.parametrize(
    "page", [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")], ids=lambda p: p.name
)
def test_what_a_page_links_to_is_there(page):
    for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
        assert (page.parent / link).exists(), link


def test_the_readme_is_short_and_its_commands_are_known():
    text = (ROOT / "README.md").read_text()
    assert len(text.splitlines()) <= 100
    for command in re.findall(r"^make ([a-z-]+)", text, re.M):
        assert f"\n{command}:" in (ROOT / "Makefile").read_text(), command


def test_the_pinned_pair_is_installed_or_named_in_one_line():
    text = (ROOT / "pyproject.toml").read_text()
    assert '"mujoco>=3.17,<3.18"' in text
    assert '"dm-control==1.0.50"' in text
