"""Every wrong scene file gets one line that names the file, the key and the remedy."""

import copy
import random
import tomllib

import pytest
import tomli_w

from taichifem.description import Scene
from taichifem.errors import InputError
from taichifem.scene import read_scene

BODY = '[[body]]\nmesh = { shape = "bar", cells = [2, 1, 1] }\n'
TWO_TIMES = "times = [0, 1]"

# name: (text, what the message says)
BAD = {
    "syntax": ('[[body]\nname = "x"', ["no valid TOML", "line 1"]),
    "syntax-later": (BODY + "scale = = 2", ["no valid TOML", "line 3"]),
    "key-twice": (BODY + "scale = 1\nscale = 2\n", ["no valid TOML", "line 4"]),
    "empty": ("", ["is empty", "[[body]]"]),
    "only-a-comment": ("# nothing\n", ["is empty"]),
    "not-utf8": (b'name = "caf\xe9"', ["not UTF-8", "byte 11"]),
    "nested-too-deep": (BODY + "position = " + "[" * 5000, ["nested too deeply"]),
    "no-body": ('name = "x"', ["missing key", "'body'"]),
    "no-bodies": ("body = []", ["no body", "add at least one"]),
    "body-is-a-table": ('[body]\nmesh = { shape = "bar" }', ["body must be an array of tables"]),
    "body-is-a-number": ("body = [3]", ["body.0 must be a table, not 3"]),
    "plural": ("[[bodies]]\nname = 'a'", ["unknown key 'bodies'", "did you mean 'body'?"]),
    "misplaced": ("gravity = [0, 0, 0]\n" + BODY, ["'gravity'", "did you mean 'simulation.gravity'?"]),
    "misspelt-setting": (BODY + "[simulation]\nsubstep = 2", ["'simulation.substep'", "'simulation.substeps'"]),
    "settings-are-a-list": ("simulation = [1]\n" + BODY, ["simulation must be a table"]),
    "no-mesh": ('[[body]]\nname = "x"', ["body.0: missing key", "'mesh'"]),
    "mesh-is-a-text": ('[[body]]\nmesh = "bear.msh"', ["body.0.mesh must be a table", "'bear.msh'"]),
    "mesh-of-both": ('[[body]]\nmesh = { shape = "bar", file = "a.msh" }', ["body.0.mesh", "either a shape"]),
    "mesh-of-neither": ("[[body]]\nmesh = { tets = 100 }", ["body.0.mesh", "either a shape"]),
    "unknown-shape": ('[[body]]\nmesh = { shape = "cube" }', ["body.0.mesh.shape is 'cube'", "'bar'"]),
    "shape-is-a-list": ('[[body]]\nmesh = { shape = ["bar"] }', ["body.0.mesh.shape is ['bar']"]),
    "shape-parameter": ('[[body]]\nmesh = { shape = "sphere", radios = 1 }', ["body.0.mesh", "mean 'radius'?"]),
    "shape-value": ('[[body]]\nmesh = { shape = "sphere", radius = -1 }', ["body.0.mesh.radius must be", "-1"]),
    "shape-type": ('[[body]]\nmesh = { shape = "bar", size = "big" }', ["body.0.mesh.size must be", "'big'"]),
    "mesh-missing": ('[[body]]\nmesh = { file = "no.msh" }', ["body.0.mesh: ", "no.msh"]),
    "mesh-file-type": ("[[body]]\nmesh = { file = 3 }", ["body.0.mesh.file must be a text"]),
    "tets-type": ('[[body]]\nmesh = { file = "a.obj", tets = 2.5 }', ["body.0.mesh.tets must be a whole number"]),
    "tets-value": ('[[body]]\nmesh = { file = "a.obj", tets = 0 }', ["body.0.mesh.tets must be at least 1"]),
    "asset-missing": ('[[body]]\nmesh = { file = "asset:unicorn" }', ["body.0.mesh", "unicorn"]),
    "misspelt-material": (BODY + "material = { yungs = 2e5 }", ["body.0.material", "'yungs'", "mean 'youngs'?"]),
    "unlike-any-key": (BODY + "material = { zzz = 1 }", ["'zzz'", "known are model, youngs, poisson"]),
    "material-value": (BODY + "material = { youngs = -5 }", ["body.0.material.youngs is -5", "above 0 [Pa]"]),
    "poisson": (BODY + "material = { poisson = 0.5 }", ["body.0.material.poisson is 0.5", "below 0.5"]),
    "material-type": (BODY + 'material = { density = "heavy" }', ["body.0.material.density must be a number"]),
    "material-flag": (BODY + "material = { density = true }", ["body.0.material.density must be a number"]),
    "material-infinite": (BODY + "material = { youngs = inf }", ["body.0.material.youngs is inf", "finite"]),
    "material-model": (BODY + 'material = { model = "magic" }', ["body.0.material.model is 'magic'", "'linear'"]),
    "material-number": (BODY + "material = 3", ["body.0.material must be a table"]),
    "preset": (BODY + 'material = "ruber"', ["body.0.material.preset", "'ruber'", "did you mean 'rubber'?"]),
    "preset-type": (BODY + "material = { preset = 1 }", ["body.0.material.preset must be a text"]),
    "region-number": (BODY + 'materials = { core = "foam" }', ["body.0.materials", "'core'", "region"]),
    "region-absent": (BODY + 'materials = { 7 = "foam" }', ["body.0.materials names region 7", "[0]"]),
    "materials-list": (BODY + 'materials = ["foam"]', ["body.0.materials must be a table"]),
    "vector-length": (BODY + "position = [0, 0]", ["body.0.position must be a list of 3 numbers"]),
    "vector-entry": (BODY + 'position = [0, "1", 0]', ["body.0.position.1 must be a number", "'1'"]),
    "vector-huge": (BODY + f"position = [0, 0, {10**400}]", ["body.0.position.2 is inf: give a finite number"]),
    "axis-zero": (BODY + "axis = [0, 0, 0]", ["body.0.axis is (0, 0, 0)", "direction"]),
    "date": (BODY + "angle = 2024-01-01", ["body.0.angle must be a number"]),
    "pin-empty": (BODY + "[[body.pin]]\naxes = 'x'", ["body.0.pin.0: missing key", "'box' or 'sphere'"]),
    "pin-twice": (
        BODY + "[[body.pin]]\nindices = [0]\nnearest = [0, 0, 0]",
        ["body.0.pin.0 says its region twice", "nearest"],
    ),
    "pin-table": (BODY + "[body.pin]\nindices = [0]", ["body.0.pin must be an array of tables"]),
    "pin-box": (BODY + "[[body.pin]]\nbox = { lower = [0, 0, 0] }", ["body.0.pin.0.box: missing key: give 'upper'"]),
    "pin-box-order": (
        BODY + "[[body.pin]]\nbox = { lower = [1, 0, 0], upper = [0, 1, 1] }",
        ["body.0.pin.0.box", "lies above", "exchange"],
    ),
    "pin-axes": (BODY + "[[body.pin]]\nindices = [0]\naxes = 'xw'", ["body.0.pin.0.axes is 'xw'", "xyz"]),
    "pin-indices": (BODY + "[[body.pin]]\nindices = [0, 1.5]", ["body.0.pin.0.indices.1 must be a whole number"]),
    "pin-indices-huge": (BODY + f"[[body.pin]]\nindices = [{2**70}]", ["body.0.pin.0.indices.0", "2^31"]),
    "pin-nearest": (BODY + "[[body.pin]]\nnearest = 3", ["body.0.pin.0.nearest must be a table, not 3"]),
    "motion-order": (
        BODY + "[[body.pin]]\nindices = [0]\nmotion = { times = [1, 0] }",
        ["body.0.pin.0.motion.times", "must increase"],
    ),
    "motion-count": (
        BODY + f"[[body.pin]]\nindices = [0]\nmotion = {{ {TWO_TIMES}, angle = [1] }}",
        ["body.0.pin.0.motion.angle has 1 entries for 2 times"],
    ),
    "motion-translation": (
        BODY + f"[[body.pin]]\nindices = [0]\nmotion = {{ {TWO_TIMES}, translation = [0, 1] }}",
        ["body.0.pin.0.motion.translation.0 must be a list of 3 numbers"],
    ),
    "motion-smooth": (
        BODY + "[[body.pin]]\nindices = [0]\nmotion = { smooth = 1 }",
        ["body.0.pin.0.motion.smooth must be true or false"],
    ),
    "handle-until": (
        BODY + "[[body.handle]]\nindices = [0]\nstart = 2\nuntil = 1",
        ["body.0.handle.0.until is 1", "above 2"],
    ),
    "second-body": (BODY + BODY + "scale = 0", ["body.1.scale is 0", "above 0"]),
    "collider-type": (BODY + "[[collider]]\nfriction = 0", ["collider.0.type is missing", "'plane'"]),
    "collider-unknown": (BODY + "[[collider]]\ntype = 'cone'", ["collider.0.type is 'cone'", "'sphere'"]),
    "collider-missing": (BODY + "[[collider]]\ntype = 'sphere'\nradius = 1", ["collider.0: missing", "'center'"]),
    "collider-value": (BODY + "[[collider]]\ntype = 'plane'\nfriction = -1", ["collider.0.friction is -1"]),
    "collider-key": (BODY + "[[collider]]\ntype = 'plane'\nradius = 1", ["collider.0: unknown key 'radius'"]),
    "fps": (BODY + "[simulation]\nfps = 0", ["simulation.fps is 0", "above 0"]),
    "substeps": (BODY + "[simulation]\nsubsteps = 2.0", ["simulation.substeps must be a whole number"]),
    "integrator": (BODY + "[simulation]\nintegrator = 'euler'", ["simulation.integrator is 'euler'", "backward"]),
    "camera": (BODY + "[camera]\neye = [1, 1, 1]\ntarget = [1, 1, 1]", ["camera", "same point"]),
    "view-color": (BODY + "[view]\ncolor = 'stress'", ["view.color is 'stress'", "'von-mises'"]),
    "view-range": (BODY + "[view]\nrange = [1]", ["view.range must be a list of 2 numbers"]),
    "view-range-order": (BODY + "[view]\nrange = [2, 1]", ["view.range (2.0, 1.0)", "low before high"]),
    "view-colors": (BODY + "[view]\ncolors = ['red']", ["view.colors[0] is 'red'", "#rrggbb"]),
    "line-break-in-key": (BODY + '"a\\nb" = 1', ["body.0: unknown key 'a\\nb'"]),
    "name-type": ("name = 3\n" + BODY, ["name must be a text"]),
}


def complaint(path) -> str:
    with pytest.raises(InputError) as caught:
        read_scene(path)
    message = str(caught.value)
    assert len(message.splitlines()) == 1 and len(message) < 400
    assert message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


@pytest.mark.parametrize("case", BAD)
def test_bad_scene(scene_file, case):
    text, fragments = BAD[case]
    message = complaint(scene_file(text))
    for fragment in fragments:
        assert fragment in message


def test_no_file(tmp_path):
    assert "no such scene file" in complaint(tmp_path / "absent.toml")
    assert "is a folder" in complaint(tmp_path)
    assert "embedded null" in complaint(f"{tmp_path}/\0.toml")


JUNK = [None, True, -1, 0, 0.5, -2.5, float("nan"), float("inf"), 10**400, "", "rubber", "bar", "\n"]
JUNK += [[], [1], [0, 0, 0], [[1, 2, 3]], [[]], {}, {"times": [0]}, {"x": {"y": 1}}, [{}], "2e5", 7, 3.0]


def mutate(tree, rng: random.Random) -> None:
    """Spoil one place of the tree: drop it, rename it, or put junk or another part of the tree there."""
    places, stack = [], [tree]
    while stack:
        node = stack.pop()
        for key in list(node) if isinstance(node, dict) else range(len(node)):
            places.append((node, key))
            if isinstance(node[key], dict | list):
                stack.append(node[key])
    node, key = rng.choice(places)
    action = rng.randrange(4)
    if action == 0:
        del node[key]
    elif action == 1 and isinstance(node, dict):
        node[str(key)[:-1] + rng.choice("sxy")] = node.pop(key)
    elif action == 2:
        other, there = rng.choice(places)
        node[key] = copy.deepcopy(other[there])
    else:
        junk = rng.choice(JUNK)
        node[key] = {} if junk is None else copy.deepcopy(junk)


@pytest.mark.parametrize("seed", range(8))
def test_a_spoilt_scene_is_read_or_refused_in_one_line(everything, scene_file, seed):
    rng, good = random.Random(seed), tomllib.loads(everything.read_text())
    read = refused = 0
    for _ in range(60):
        tree = copy.deepcopy(good)
        for _ in range(rng.randint(1, 3)):
            mutate(tree, rng)
        path = scene_file(tomli_w.dumps(tree))
        try:
            assert isinstance(read_scene(path), Scene)
            read += 1
        except InputError as error:
            assert len(str(error).splitlines()) == 1 and str(error).startswith(str(path))
            refused += 1
    assert read and refused


@pytest.mark.parametrize("seed", range(4))
def test_spoilt_text_is_read_or_refused_in_one_line(everything, scene_file, seed):
    rng, good = random.Random(seed), everything.read_bytes()
    for _ in range(50):
        text = bytearray(good)
        for _ in range(rng.randint(1, 4)):
            start = rng.randrange(len(text))
            text[start : start + rng.randrange(12)] = rng.choice([b"", b"\x00", b"\xff", b'"', b"[", b"= ", b"\n"])
        try:
            assert isinstance(read_scene(scene_file(bytes(text))), Scene)
        except InputError as error:
            assert len(str(error).splitlines()) == 1
