"""Whether two builds of covol give identical results: every job runs with both, and every file that it writes is compared.

    /usr/bin/python3 tests/bench/same_bits.py BEFORE/bin/covol AFTER/bin/covol [--only PART] [--work FOLDER]

Ignored are the random UUID in the header of a .vdb, and times, memory and the program's version in a report. The printed output is
compared without its times. Exit code 1: something differs.
"""
import argparse
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

import numpy as np
import tifffile

SIZE, H = 48, 0.5
ORIGIN = -H * (SIZE - 1) / 2

# Each line is the name of a job and the arguments of covol. A job runs in a folder of its own. ../in contains the files
# that make_inputs() makes, and ../NAME the outputs of a previous job.
JOBS = """
phantom_torus      phantom torus --size 48 -o i.nrrd --points p.xyz --labels t.nrrd
phantom_round      phantom sphere-round --size 64 -o i.nii.gz --points p.ply
phantom_box        phantom box --size 40 -o i.mha --points p.csv --noise 0.2 --seed 3
phantom_slit       phantom sphere-slit --size 64 -o i.tif --points p.xyz
image_and_points   segment ../in/ball.nrrd --points ../in/ball.xyz -o s.vdb --mesh s.ply --mask m.nrrd --density d.vdb --fields f.vdb --evidence e.csv --table t.csv --json r.json
few_marks          segment ../in/ball.nrrd --points ../in/few.csv -o s.vdb --mesh s.obj --mask m.nii.gz --suggest 3 --json r.json
few_marks_alone    segment ../in/ball.nrrd --points ../in/few.csv --rho 0 -o s.vdb --mesh s.stl --mask m.mha --json r.json
few_and_sides      segment ../in/two.nrrd --points ../in/few.csv --inside 0,0,0 --outside 9,9,9 -o s.vdb --mask m.tif --json r.json
tag                segment ../in/ball.nrrd --points ../in/ball.xyz --init tag --tag-distance 3vx -o s.vdb --mesh s.off --json r.json
paper              segment ../in/ball.nrrd --points ../in/ball.xyz --model paper -o s.vdb --mesh s.glb --json r.json
paper_lines        segment ../in/shell.nrrd --points ../in/ball.xyz --model paper --edge-feature bright-line -o s.vdb --json r.json
paper_coarse       segment ../in/ball.nrrd --theta 0 --init sphere:0,0,0,5 --coarse-levels 1 -o s.vdb --json r.json
grow               segment ../in/ball.nrrd --theta 0 --init sphere:0,0,0,2 -o s.vdb --json r.json
grow_box           segment ../in/ball.nrrd --theta 0 --init box:-2,-2,-2,2,2,2 -o s.vdb --half --json r.json
grow_seed          segment ../in/ball.nrrd --inside 0,0,0 -o s.vdb --json r.json
roi                segment ../in/ball.nrrd --points ../in/ball.xyz --roi -10,-10,-10,10,10,10 -o s.vdb --mask m.nrrd --json r.json
finer              segment ../in/ball.nrrd --points ../in/ball.xyz --voxel-size 0.4 -o s.vdb --json r.json
anisotropic        segment ../in/slices.tif --points ../in/shifted.csv -o s.vdb --mask m.tif --json r.json
guess_mask         segment ../in/ball.nrrd --guess ../in/cube.nrrd --points ../in/few.csv -o s.vdb --mask m.nrrd --json r.json
init_mask          segment ../in/ball.nrrd --points ../in/ball.xyz --init mask:../in/cube.nrrd -o s.vdb --json r.json
init_mesh          segment ../in/ball.nrrd --points ../in/few.csv --init mesh:../image_and_points/s.ply -o s.vdb --json r.json
init_vdb           segment ../in/ball.nrrd --points ../in/few.csv --init vdb:../image_and_points/s.vdb -o s.vdb --json r.json
contours           segment ../in/ball.nrrd --contours ../in/contours.csv -o s.vdb --mesh s.ply --json r.json
contours_alone     segment ../in/ball.nrrd --contours ../in/contours.csv --rho 0 --contour-curve lines -o s.vdb --json r.json
contours_lines     segment ../in/shell.nrrd --contours ../in/contours.csv -o s.vdb --json r.json
painted            segment ../in/ball.nrrd --painted ../in/painted.nrrd -o s.vdb --mask m.nrrd --json r.json
structures         segment ../in/two.nrrd --points left=../in/left.xyz right=../in/few.csv -o s.vdb --mask m.seg.nrrd --mesh s.glb --table t.csv --json r.json
timelapse          segment ../in/movie.tif --frame 0-2 --points ../in/shifted.csv -o s.vdb --mesh s.ply --table t.csv --json r.json
dicom_like_raw     segment ../in/ball.mhd --points ../in/few.csv -o s.vdb --json r.json
marks_fiji         segment ../in/slices.tif --points ../in/fiji.csv -o s.vdb --json r.json
cloud              reconstruct ../in/cloud.ply -o s.vdb --mesh s.ply --json r.json
cloud_noisy        reconstruct ../in/noisy.xyz -o s.vdb --mesh s.ply --json r.json
cloud_half         reconstruct ../in/half.xyz -o s.vdb --mesh s.ply --holes open --json r.json
cloud_flat         reconstruct ../in/half.xyz -o s.vdb --mesh s.ply --holes flat --json r.json
cloud_cleaned      reconstruct ../in/noisy.xyz --remove-outliers --smooth jets -o s.vdb --mesh s.ply --json r.json
cloud_few          reconstruct ../in/ball.xyz -o s.vdb --mesh s.ply --json r.json
cloud_tag          reconstruct ../in/cloud.ply --init tag -o s.vdb --mesh s.ply --json r.json
cloud_paper        reconstruct ../in/cloud.ply --model paper -o s.vdb --mesh s.ply --json r.json
cloud_scan_tag     reconstruct ../in/half.xyz --init tag -o s.vdb --json r.json
mesh_adaptive      mesh ../cloud/s.vdb -o s.ply --adaptive 0.2vx --json r.json
mesh_target_edge   mesh ../cloud/s.vdb -o s.ply --target-edge 3vx --json r.json
distance           distance ../in/ball.xyz --like ../in/ball.nrrd --max-distance 8vx -o d.vdb --json r.json
band               band ../distance/d.vdb --tag-distance 3vx -o b.vdb --json r.json
edge               edge ../in/ball.nrrd --band ../band/b.vdb -o e.vdb --json r.json
evolve             evolve ../band/b.vdb --distance ../distance/d.vdb --edge ../edge/e.vdb -o u.vdb --json r.json
surface            surface ../evolve/u.vdb -o s.vdb --json r.json
mesh               mesh ../surface/s.vdb -o s.ply --json r.json
mask               mask ../surface/s.vdb --like ../in/ball.nrrd -o m.nrrd --json r.json
compare_masks      compare ../mask/m.nrrd ../in/cube.nrrd --json r.json
compare_surfaces   compare ../surface/s.vdb ../image_and_points/s.ply --json r.json
compare_points     compare ../in/few.csv ../surface/s.vdb --json r.json
info_vdb           info ../surface/s.vdb --json r.json
info_image         info ../in/slices.tif --json r.json
info_mesh          info ../mesh/s.ply --json r.json
info_points        info ../in/noisy.xyz --json r.json
check_mesh         check ../mesh/s.ply --json r.json
check_points       check ../in/half.xyz --json r.json
convert_image      convert ../in/ball.nrrd i.vdb --json r.json
convert_back       convert ../convert_image/i.vdb i.tif --json r.json
convert_points     convert ../in/noisy.xyz p.ply --simplify 0.3 --json r.json
convert_mesh       convert ../mesh/s.ply s.off --json r.json
render             render ../surface/s.vdb --image ../in/ball.nrrd --points ../in/few.csv -o p.png
outside            segment ../in/ball.nrrd --points ../in/outside.csv -o s.vdb --json r.json
no_file            segment ../in/none.nrrd --points ../in/few.csv -o s.vdb
bad_option         segment ../in/ball.nrrd --points ../in/few.csv -o s.vdb --delta -1vx
"""


def sphere(count):
    turn, up = np.pi * (3 - 5 ** 0.5) * np.arange(count), 1 - (2 * np.arange(count) + 1) / count
    return np.stack([np.sqrt(1 - up ** 2) * np.cos(turn), np.sqrt(1 - up ** 2) * np.sin(turn), up], axis=1)


def write_nrrd(path, values, spacing=(H, H, H), origin=(ORIGIN,) * 3):
    kind = {"uint8": "uint8", "float32": "float"}[values.dtype.name]
    header = f"NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {' '.join(map(str, values.shape[::-1]))}\nspace dimension: 3\n" \
        f"space directions: ({spacing[0]},0,0) (0,{spacing[1]},0) (0,0,{spacing[2]})\n" \
        f"space origin: ({','.join(map(str, origin))})\nencoding: raw\nendian: little\n\n"
    path.write_bytes(header.encode() + values.tobytes())


def make_inputs(folder):
    """Balls of radius about 7 around the origin, with bumps."""
    random = np.random.default_rng(1)
    axis = ORIGIN + H * np.arange(SIZE)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")

    def off(center=(0, 0, 0), size=7.0):
        dx, dy, dz = x - center[0], y - center[1], z - center[2]
        r = np.sqrt(dx ** 2 + dy ** 2 + dz ** 2) + 1e-9
        return size * (1 + 0.1 * np.cos(3 * np.arctan2(dy, dx)) * (1 - (dz / r) ** 2)) - r

    def bumpy(count, size=7.0):
        n = sphere(count)
        return size * n * (1 + 0.1 * np.cos(3 * np.arctan2(n[:, 1], n[:, 0])) * (1 - n[:, 2] ** 2))[:, None]

    def solid(*balls):
        values = 20 + 180 * np.clip(np.max([ball / H for ball in balls], axis=0) + 0.5, 0, 1)
        return np.clip(values + random.normal(0, 8, values.shape), 0, 255).astype(np.uint8)

    def table(name, points, header=""):
        np.savetxt(folder / name, points, "%.6f", "," if name.endswith("csv") else " ", header=header, comments="")

    ball = solid(off())
    write_nrrd(folder / "ball.nrrd", ball)
    write_nrrd(folder / "two.nrrd", solid(off(), off((8, 7, 6), 3.0)))
    write_nrrd(folder / "shell.nrrd", (20 + 180 * np.exp(-0.5 * (off() / 0.7) ** 2)).astype(np.float32))
    write_nrrd(folder / "cube.nrrd", (np.max(np.abs([x, y, z]), axis=0) < 6).astype(np.uint8))
    painted = np.zeros(ball.shape, np.uint8)
    painted[::6] = np.where(off()[::6] > 0, 1, 0)
    write_nrrd(folder / "painted.nrrd", painted)
    (folder / "ball.raw").write_bytes(ball.tobytes())
    (folder / "ball.mhd").write_text(f"ObjectType = Image\nNDims = 3\nDimSize = {SIZE} {SIZE} {SIZE}\nElementType = MET_UCHAR\n"
                                     f"ElementSpacing = {H} {H} {H}\nOffset = {ORIGIN} {ORIGIN} {ORIGIN}\nElementDataFile = ball.raw\n")
    metadata = {"axes": "ZYX", "spacing": 2 * H, "unit": "um"}
    shifted = bumpy(60) - ORIGIN
    tifffile.imwrite(folder / "slices.tif", ball[::2], imagej=True, resolution=(1 / H, 1 / H), metadata=metadata)
    movie = np.stack([solid(off((0.4 * t, 0, 0), 7 + 0.2 * t)) for t in range(3)])
    tifffile.imwrite(folder / "movie.tif", movie, imagej=True, resolution=(1 / H, 1 / H), metadata={"axes": "TZYX", "spacing": H, "unit": "um"})
    table("ball.xyz", bumpy(5000))
    table("few.csv", bumpy(60) + random.normal(0, 0.1, (60, 3)), "x,y,z")
    table("shifted.csv", shifted, "x,y,z")
    table("left.xyz", np.array((8, 7, 6)) + 3 * sphere(400))
    table("outside.csv", bumpy(60) + 100, "x,y,z")
    rows = [(k, 0, *(mark[:2] - ORIGIN) / H) for k in range(12, 38, 4)
            for mark in [(a * np.cos(t), a * np.sin(t)) for a in [max(0.5, (49 - (ORIGIN + H * k) ** 2) ** 0.5)] for t in np.arange(0, 6.28, 0.3)]
            for mark in [np.array(mark)]]
    table("contours.csv", rows, "slice,contour,x_px,y_px")
    table("fiji.csv", np.stack([shifted[:, 0], shifted[:, 1], 1 + shifted[:, 2] / (2 * H)], 1), "X,Y,Slice")
    cloud = bumpy(9000).astype("<f4")
    (folder / "cloud.ply").write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 9000\nproperty float x\nproperty float y\n"
                                       b"property float z\nend_header\n" + cloud.tobytes())
    noisy = np.concatenate([bumpy(8000) + random.normal(0, 0.08, (8000, 3)), random.uniform(-10, 10, (200, 3))])
    table("noisy.xyz", noisy)
    half = bumpy(12000)
    table("half.xyz", half[half[:, 2] > -1])


VOLATILE = re.compile(r"second|_s$|memory|bytes|version|threads|load|peak|date|rss")


def without_volatile(value):
    if isinstance(value, dict):
        return {key: without_volatile(item) for key, item in value.items() if not VOLATILE.search(key)}
    return [without_volatile(item) for item in value] if isinstance(value, list) else value


def content(path):
    data = path.read_bytes()
    if path.suffix == ".vdb":
        return re.sub(rb"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}", b"", data, count=1)
    if path.suffix == ".json":
        return json.dumps(without_volatile(json.loads(data)), sort_keys=True).encode()
    if path.suffix == ".csv" and b"seconds" in data.split(b"\n", 1)[0]:
        rows = [line.split(b",") for line in data.split(b"\n")]
        return b"\n".join(b",".join(cell for name, cell in zip(rows[0], row) if name != b"seconds") for row in rows)
    return data


def run(covol, folder, arguments):
    """{file: its content as far as it is compared}, with the printed output and the exit code."""
    folder.mkdir(parents=True)
    own = os.environ | {"LD_LIBRARY_PATH": str(covol.parent.parent / "lib")}  # a copied build uses its own libcovol
    done = subprocess.run([covol, *shlex.split(arguments), "--threads", "2"], cwd=folder, capture_output=True, text=True, env=own)
    printed = re.sub(r"[\d.]+ (s|GB|MB|GiB|MiB)\b", "", done.stdout + done.stderr)
    found = {path.name: content(path) for path in sorted(folder.iterdir())}
    return found | {"(printed)": printed.encode(), "(exit code)": str(done.returncode).encode()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("--only", default="", help="jobs whose name has this in it, and those that they need")
    parser.add_argument("--work", help="an empty folder, which stays [a temporary one]")
    options = parser.parse_args()
    jobs = dict(line.split(None, 1) for line in JOBS.strip().splitlines())
    chosen = [name for name in jobs if options.only in name]
    for name in chosen:  # the loop appends to the list that it visits: the jobs of which outputs are used
        chosen += [need for need in re.findall(r"\.\./(\w+)/", jobs[name]) if need in jobs and need not in chosen]
    work = pathlib.Path(options.work or tempfile.mkdtemp(prefix="covol_bits_")).resolve()
    differ, failed = [], []
    programs = {"before": pathlib.Path(options.before).resolve(), "after": pathlib.Path(options.after).resolve()}
    for side in programs:
        (work / side / "in").mkdir(parents=True)
        make_inputs(work / side / "in")
    for name in (job for job in jobs if job in chosen):
        before, after = (run(program, work / side / name, jobs[name]) for side, program in programs.items())
        wrong = sorted(file for file in before.keys() | after.keys() if before.get(file) != after.get(file))
        if before["(exit code)"] != b"0":
            failed.append(name)
        if wrong:
            differ.append(name)
        print(f"{name}: {'DIFFERS: ' + ', '.join(wrong) if wrong else 'the same'}, {len(before) - 2} files, exit code {before['(exit code)'].decode()}", flush=True)
    print(f"{len(chosen)} jobs: {len(differ)} differ {differ}; {len(failed)} end with an error in both or the first {failed}; files in {work}")
    sys.exit(1 if differ else 0)


if __name__ == "__main__":
    main()
