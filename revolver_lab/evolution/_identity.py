"""Temporary stand-in until matching lands: elements correspond by name."""
from dataclasses import dataclass
import mujoco
from revolver_lab.evolution.canonical import LISTS
def read_robot(source, unnamed="refuse"):
    if isinstance(source, mujoco.MjSpec): return source.copy()
    s=str(source)
    return mujoco.MjSpec.from_string(s) if s.lstrip().startswith("<") else mujoco.MjSpec.from_file(s)
@dataclass(frozen=True)
class Matching: pass
def match(a,b,pins=None,root=None): return Matching()
@dataclass(frozen=True)
class Padded:
    source: object; target: object; pairs: dict
def pad(a,b,matching):
    pairs={}
    for kind,attr in LISTS.items():
        if kind=="mesh": continue
        n=[e.name for e in getattr(a,attr)]; t={e.name for e in getattr(b,attr)}
        pairs[kind]=[(x,x) for x in n if x in t]
    return Padded(a,b,pairs)
