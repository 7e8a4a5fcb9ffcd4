"""Filament (through filly) draws an original and its levels; each level has to look like the original.

    python filament.py ORIGINAL.glb LEVEL.glb... [-o DIR] [--height PX]

Fails if a level is empty from any side, upside down, or of another colour. The levels are drawn as Filament draws
them by default with 4 samples, the original once more 4 x 4 times larger and averaged, which is what they are
measured against.
"""

import argparse
import json
import math
import pathlib
import struct
import sys
import zlib

import filly
import numpy as np

SUPERSAMPLE = 4
VIEWS = [(0, 0), (90, 0), (200, 30), (0, 90)]  # azimuth, elevation; degrees
LEAST_AREA = 0.3  # share of the original's covered pixels, from every side
MOST_COLOUR_ERROR = 20.0  # mean colour, sRGB 0..255, over all views


def side(bounds, height):
    """Pixels of a square picture in which the bounds are `height` pixels high and fit from every side."""
    low, high = bounds
    return 2 * math.ceil(np.linalg.norm(high - low) * height / (high[1] - low[1]) / 2) + 4


def aim(camera, bounds, height, view):
    """Parallel rays towards the middle of the bounds."""
    low, high = bounds
    metres = side(bounds, height) * (high[1] - low[1]) / height
    azimuth, elevation = (math.radians(a) for a in view)
    towards = np.array([
        math.cos(elevation) * math.sin(azimuth),
        math.sin(elevation),
        math.cos(elevation) * math.cos(azimuth),
    ])
    centre = (low + high) / 2
    camera.set_orthographic(height=metres, near=0.01 * metres, far=4.0 * metres)
    camera.position = list(centre + 2.0 * metres * towards)
    camera.look_at(list(centre), up=[0.0, 0.0, -1.0] if abs(view[1]) > 89 else [0.0, 1.0, 0.0])


def draw(renderer, file, frame, height, factor):
    """Pictures from all views, rows from the top down: colour multiplied by coverage, and coverage; 0..255."""
    scene = renderer.create_scene()
    model = scene.load(str(file))
    bounds = tuple(np.array(b, dtype=float) for b in model.bounds)
    frame = frame or bounds
    scene.background = [0.0, 0.0, 0.0, 0.0]
    scene.transparent = True
    scene.msaa = 4
    scene.environment = renderer.create_environment(np.full((16, 32, 3), 1.0, dtype=np.float32))
    scene.environment_visible = False
    scene.environment_intensity = 20_000
    scene.add_directional_light(direction=(-1.0, -2.0, -1.5), intensity=60_000)
    scene.camera = camera = renderer.create_camera()
    pixels = side(frame, height)
    target = renderer.create_render_target(width=pixels * factor, height=pixels * factor)
    pictures = []
    for view in VIEWS:
        aim(camera, frame, height, view)
        renderer.render(scene, target)
        picture = target.read().astype(np.float64)
        pictures.append(picture.reshape(pixels, factor, pixels, factor, 4).mean(axis=(1, 3)))
    target.close()
    scene.close()
    return frame, pictures


def mean_colour(pictures):
    total = sum(p.sum(axis=(0, 1)) for p in pictures)
    return 255.0 * total[:3] / max(total[3], 1e-9)


def overlap(a, b):
    """Share of two profiles that they have in common."""
    return float(np.minimum(a / max(a.sum(), 1), b / max(b.sum(), 1)).sum())


def compare(pictures, references):
    """Figures of one file over all views, and what is wrong with it."""
    areas, f1s, upright = [], [], []
    for view, picture, reference in zip(VIEWS, pictures, references):
        mask, wanted = picture[..., 3] >= 127.5, reference[..., 3] >= 127.5
        areas.append(float(mask.sum() / max(wanted.sum(), 1)))
        f1s.append(float(2 * (mask & wanted).sum() / max(mask.sum() + wanted.sum(), 1)))
        if abs(view[1]) < 60:
            rows = wanted.sum(axis=1)
            upright.append(overlap(mask.sum(axis=1), rows) - overlap(mask.sum(axis=1), rows[::-1]))
    colour_error = float(np.linalg.norm(mean_colour(pictures) - mean_colour(references)))
    faults = []
    if min(areas) < LEAST_AREA:
        faults.append(f"covers {min(areas):.2f} of the original in one view")
    if np.mean(upright) < 0:
        faults.append("looks more like the tree upside down")
    if colour_error > MOST_COLOUR_ERROR:
        faults.append(f"mean colour is {colour_error:.1f} off")
    figures = {"f1": f1s, "area_ratio": areas, "upright": float(np.mean(upright)), "colour_error": colour_error}
    return figures, faults


def write_png(file, rows):
    """A grid of pictures on a sky, as an RGB PNG."""
    sky = np.array([184.0, 200.0, 216.0])
    grid = np.concatenate([np.concatenate(row, axis=1) for row in rows], axis=0)
    shown = np.clip(grid[..., :3] + sky * (1 - grid[..., 3:] / 255), 0, 255).astype(np.uint8)
    height, width = shown.shape[:2]
    raw = b"".join(b"\0" + row.tobytes() for row in shown)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("original", type=pathlib.Path)
    parser.add_argument("levels", type=pathlib.Path, nargs="*")
    parser.add_argument("-o", "--out", type=pathlib.Path)
    parser.add_argument("--height", type=float, default=256.0)
    args = parser.parse_args()

    filly.set_log_level("warning")
    report, rows, failed = [], [], False
    with filly.Renderer() as renderer:
        frame, references = draw(renderer, args.original, None, args.height, SUPERSAMPLE)
        if any(not (reference[..., 3] > 0).any() for reference in references):
            sys.exit(f"{args.original}: nothing is drawn")
        rows.append(references)
        for file in [args.original, *args.levels]:
            _, pictures = draw(renderer, file, frame, args.height, 1)
            figures, faults = compare(pictures, references)
            if file == args.original:
                faults = []  # it may well dissolve; that is its own affair
            rows.append(pictures)
            report.append({"file": str(file), "height_px": args.height, "faults": faults, **figures})
            failed |= bool(faults)
            print(
                f"{file.name:32} {args.height:.0f} px F1 {np.mean(figures['f1']):.3f} / {min(figures['f1']):.3f}"
                f"  area {np.mean(figures['area_ratio']):.3f} / {min(figures['area_ratio']):.3f}"
                f"  colour {figures['colour_error']:.1f}  upright {figures['upright']:.2f}"
            )
            for fault in faults:
                print(f"FAIL {file.name}: {fault}")
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
        (args.out / "filament.json").write_text(json.dumps(report, indent=1))
        write_png(args.out / "filament.png", rows)
    sys.exit(failed)


if __name__ == "__main__":
    main()
