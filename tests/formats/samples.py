"""Correct files for every reader of recordings, keypoints and models, and functions that damage them."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline import formats
from pipeline.storage.sealed_folders import compact
from tests.formats.contract import FIXTURES
from tests.formats.points.test_sections import NEXUS_WITH_DEVICES, OPTITRACK
from walk3d.anatomy.prior import BONES, PAIRS
from walk3d.film import keypoints
from walk3d.film.reconstruct import model_file
from walk3d.film.walk.calibration import CYCLE_KINDS
from walk3d.film.walk.sagittal_angles import KINDS
from walk3d.film.walk.training import BLOCKS, SIZE

Damage = Callable[[bytes, np.random.Generator], bytes]


@dataclass(frozen=True)
class Sample:
    """Correct file with the files that belong to it, the name of the file to damage, and the reader."""

    name: str
    files: dict[str, bytes]
    damaged: str
    read: Callable[[Path], object]
    opened: str
    damage: Damage

    def copy(self, folder: Path, seed: int) -> tuple[Path, int]:
        """Write a damaged copy (undamaged if `seed` is -1); return the path to read and the total size, bytes."""
        rng = np.random.default_rng(max(seed, 0))
        files = dict(self.files)
        if seed >= 0:
            files[self.damaged] = self.damage(files[self.damaged], rng)
        if self.damaged.startswith("model/"):  # a digest or a seal would reject all the rest unread
            files["model/manifest.json"] = _sealed(files["model/manifest.json"], files["model/model.npz"])
        for name, data in files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(data)
        return folder / self.opened, sum(map(len, files.values()))


def text(original: bytes, rng: np.random.Generator) -> bytes:
    """Return text with bytes changed, removed, inserted or repeated, or with its end missing."""
    copy = bytearray(original)
    for _ in range(rng.integers(1, 3)):
        at = int(rng.integers(len(copy) + 1))
        match rng.integers(8):
            case 0 if at < len(copy):
                copy[at] = rng.integers(256)
            case 1:
                del copy[at : at + int(rng.integers(1, 40))]
            case 2:
                copy[at:at] = rng.bytes(int(rng.integers(1, 8)))
            case 3:
                copy[at:at] = copy[at : at + int(rng.integers(1, 40))]
            case 4 | 5 | 6 if at < len(copy):
                copy[at] = rng.choice(np.frombuffer(b'\t \n\r,;."-e0_9Xn\xff', dtype=np.uint8))
            case _:
                del copy[max(at, len(copy) // 2) :]
    return bytes(copy)


def c3d(original: bytes, rng: np.random.Generator) -> bytes:
    """Return a C3D file with damage mainly to its header and parameters, or with a missing section or end."""
    data = np.frombuffer(original, dtype=np.uint8).copy()
    reach = data.size if rng.random() < 0.3 else 1536
    begin = int(rng.integers(0, reach - 64))
    length = int(rng.integers(1, 64))
    match rng.integers(6):
        case 0:
            at = rng.integers(0, reach, size=int(rng.integers(1, 9)))
            data[at] = rng.integers(0, 256, size=at.size)
        case 1:
            data[begin] ^= 1 << int(rng.integers(0, 8))
        case 2:
            extremes = np.array([0, 1, 127, 128, 255, 256, 32767, 32768, 65535], dtype="<u2")
            word = rng.choice(extremes, size=int(rng.integers(1, 4))).tobytes()
            data[begin : begin + len(word)] = np.frombuffer(word, dtype=np.uint8)
        case 3:
            data[begin : begin + length] = rng.choice([0, 255])
        case 4:
            data = np.delete(data, np.s_[begin : begin + length])
        case _:
            data = data[: int(rng.integers(0, data.size))]
    return data.tobytes()


def npy(original: bytes, rng: np.random.Generator) -> bytes:
    """Return an NPY file with damaged bytes, or with a changed type or shape in its header."""
    if rng.random() < 0.4:
        return text(original, rng)
    stream = io.BytesIO(original)
    np.lib.format.read_magic(stream)
    shape, order, dtype = np.lib.format.read_array_header_1_0(stream)
    types = (
        "<f8",
        "<f2",
        "|u1",
        ">i8",
        "|O",
        "<c16",
        "|b1",
        "<U0",
        "<U9999",
        "<M8[s]",
        "[('a', '<f8')]",
        "x",
    )
    sizes = (0, 1, 2, 3, -1, 10**6, 2**40, 10**30)
    shape = tuple(int(rng.choice(np.array(sizes, object))) if rng.random() < 0.4 else n for n in shape)
    kind = str(rng.choice(types)) if rng.random() < 0.5 else dtype.str
    descr = kind if kind.startswith("[") else repr(kind)
    head = f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}}}\n".encode()
    return np.lib.format.magic(1, 0) + len(head).to_bytes(2, "little") + head + stream.read()


def npz(original: bytes, rng: np.random.Generator) -> bytes:
    """Return an NPZ file with damaged bytes, with one damaged array and a matching checksum, or without an array."""
    if rng.random() < 0.2:
        return text(original, rng)
    with zipfile.ZipFile(io.BytesIO(original)) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    name = str(rng.choice(list(entries)))
    if rng.random() < 0.1:
        del entries[name]
    else:
        entries[name] = npy(entries[name], rng)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    return packed.getvalue()


def json_tree(original: bytes, rng: np.random.Generator) -> bytes:
    """Return JSON with damaged text, or with one value replaced by a value of any type."""
    if rng.random() < 0.4:
        return text(original, rng)
    tree = [json.loads(original)]
    others = (
        None, True, -1, 0, 1e308, 10**400, "", "x", "9" * 30, "9" * 5000, [], {}, [[]], [1, 2, 3], {"x": 1},
        [None] * 51,
    )  # fmt: skip
    node, key = tree, 0
    for _ in range(rng.integers(0, 9)):
        inner = node[key]  # type: ignore[index]
        if not isinstance(inner, dict | list) or not inner:
            break
        node = inner
        key = list(node)[rng.integers(len(node))] if isinstance(node, dict) else int(rng.integers(len(node)))
    if rng.random() < 0.2 and node is not tree:
        del node[key]
    else:
        node[key] = others[rng.integers(len(others))]
    return json.dumps(tree[0]).encode()


DAMAGE: dict[str, Damage] = {".c3d": c3d, ".npz": npz, ".npy": npy, ".json": json_tree}
"""Damage function for each file suffix; all other files are damaged as text."""


def packed(**arrays: object) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()


def _motion() -> list[Sample]:
    skeleton = {"asf_by_hand.asf": (FIXTURES / "asf_by_hand.asf").read_bytes()}
    files = {
        path.name: path.read_bytes() for path in sorted(FIXTURES.iterdir()) if path.suffix in formats.READERS
    }
    mat = files["mat_two_markers.mat"]
    squeezed = zlib.compress(mat[128:])
    files["mat_compressed.mat"] = mat[:128] + np.array([15, len(squeezed)], "<u4").tobytes() + squeezed
    files |= {"csv_nexus.csv": NEXUS_WITH_DEVICES.encode(), "csv_optitrack.csv": OPTITRACK.encode()}
    files["npz_amass.npz"] = packed(
        marker_labels=np.array(["LANK", "RANK"]),
        marker_data=np.ones((3, 2, 3)),
        mocap_framerate=np.array(120.0),
    )
    result = []
    for name, data in files.items():
        suffix = Path(name).suffix
        neighbours = skeleton if suffix == ".amc" else {}
        damage = DAMAGE.get(suffix, text)
        result.append(Sample(name, {name: data, **neighbours}, name, formats.read, name, damage))
        if neighbours:
            hurt = next(iter(neighbours))
            result.append(Sample(hurt, {name: data, **neighbours}, hurt, formats.read, name, text))
    return result


def _keypoints() -> list[Sample]:
    points = np.arange(1.0, 100.0).reshape(33, 3) % 7 + 1
    flat = points[:17].ravel().tolist()
    person = {"keypoints": points[:17, :2].tolist(), "keypoint_scores": [0.5] * 17, "track_id": 1}
    mark = {"x": 0.25, "y": 0.5, "z": 0.0, "visibility": 0.9}
    alphapose = [{"image_id": f"{k}.jpg", "keypoints": flat, "idx": k % 2, "score": 1.0} for k in range(4)]
    array = io.BytesIO()
    np.save(array, np.stack([points[:17]] * 3), allow_pickle=False)
    px = (
        "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n30\t2\t2\tpx\n"
        "Frame#\tTime\tLKnee\t\t\tRKnee\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n1\t0\t5\t6\t0\t1\t2\t0\n2\t0.03\t7\t8\t0\t1\t2\t0\n"
    )
    mmpose = {
        "meta_info": {"keypoint_id2name": {str(k): f"p{k}" for k in range(17)}},
        "instance_info": [{"frame_id": k, "instances": [person]} for k in range(1, 4)],
    }
    coco = {
        "images": [{"id": k, "file_name": f"{k}.jpg", "width": 640, "height": 480} for k in range(3)],
        "annotations": [{"image_id": k, "keypoints": flat} for k in range(3)],
        "categories": [{"keypoints": [f"p{k}" for k in range(17)]}],
    }
    lines = [json.dumps({"frame": k, "landmarks": {f"p{n}": mark for n in range(17)}}) for k in range(3)]
    contents = {
        "coco.json": json.dumps(coco).encode(),
        "lines.jsonl": "\n".join(lines).encode(),
        "lines.ndjson": "\n".join(lines).encode(),
        "arrays.npz": packed(keypoints=np.stack([points[:17]] * 3), names=np.array(["a"] * 17), fps=30),
        "alphapose.json": json.dumps(alphapose).encode(),
        "mmpose.json": json.dumps(mmpose).encode(),
        "mediapipe.json": json.dumps({"fps": 30, "frames": [{"landmarks": [mark] * 33}] * 2}).encode(),
        "wide.csv": b"frame,time_s,left_knee_x,left_knee_y,left_knee_score\n0,0,1,2,0.5\n1,0.1,,,\n2,0.2,3,4,0.7\n",
        "long.csv": b"frame,person,keypoint,x,y,score\n0,a,left_knee,1,2,0.5\n2,b,left_knee,3,4,0.7\n",
        "box.tsv": b"frame_idx\tx\ty\tlhip_x\tlhip_y\tlhip_vis\n0\t9\t9\t1\t2\t0.5\n2\t9\t9\t3\t4\t0.7\n",
        "times.txt": b"timestamp,joint,x,y\n0,1,1,2\n0,2,5,6\n0.1,1,3,4\n0.1,2,7,8\n",
        "pixels.trc": px.encode(),
        "array.npy": array.getvalue(),
    }
    assert {Path(name).suffix for name in contents} == set(keypoints.READERS)
    result = [
        Sample(name, {name: data}, name, keypoints.read, name, DAMAGE.get(Path(name).suffix, text))
        for name, data in contents.items()
    ]
    frame = json.dumps({"people": [{"person_id": [-1], "pose_keypoints_2d": flat}]}).encode()
    frames = {f"openpose/walk_{k:012d}_keypoints.json": frame for k in range(3)}
    result.append(Sample("openpose", frames, list(frames)[1], keypoints.read, "openpose", json_tree))
    return result


def _sealed(manifest: bytes, data: bytes) -> bytes:
    """Return a model's manifest with a matching digest and a valid seal; invalid JSON is returned unchanged."""
    with suppress(ValueError, TypeError):
        facts = json.loads(manifest)
        digest = hashlib.sha256(data).hexdigest()
        facts |= {"sha256": digest, "files": {"model.npz": {"bytes": len(data), "sha256": digest}}}
        facts.pop("seal", None)
        return json.dumps(facts | {"seal": hashlib.sha256(compact(facts)).hexdigest()}).encode()
    return manifest


def _model() -> list[Sample]:
    ones = np.ones
    data = packed(
        mean=ones((15, 3, BLOCKS)), components=ones((1, SIZE)), eigenvalues=ones(1),
        within=ones(((BLOCKS + 1) // 2, 45, 45)), bone_variance=ones(len(BONES)), pair_variance=ones(len(PAIRS)),
        aperiodic_variance=ones((15, 3)), log_frequency=ones(2), joints_multipliers=ones((2, 8, 3, 3)),
        angles_multipliers=ones((2, len(KINDS), 3)),
        cycle_multipliers=ones((2, len(CYCLE_KINDS), 3)), view_multipliers=ones((2, 2, 3)),
    )  # fmt: skip
    manifest = {
        "version": model_file.VERSION,
        "sha256": hashlib.sha256(data).hexdigest(),
        "walkers": 9,
        "people_by_source": {"x": 9},
    }
    files = {"model/model.npz": data, "model/manifest.json": _sealed(json.dumps(manifest).encode(), data)}
    return [
        Sample(name, files, f"model/{name}", model_file.load, "model", DAMAGE[Path(name).suffix])
        for name in ("model.npz", "manifest.json")
    ]


SAMPLES = [*_motion(), *_keypoints(), *_model()]
