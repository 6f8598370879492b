"""Runs the readers under libFuzzer, each from small valid files; tests/fuzz/run.sh builds what it needs and calls it.

A finding is a crash, a sanitizer's report, an exception that is no covol::Error, and, if the file is read in a process of its own,
more than --limit seconds, a single allocation above 64 MB and ten times the largest file, or 512 MB of memory (including the
sanitizer's own). Findings are kept in --keep; the corpus is kept in --corpus, if given, for the next time. Standard library,
numpy, pydicom, h5py.
"""
import argparse
import concurrent.futures
import gzip
import io
import lzma
import os
import pathlib
import re
import struct
import subprocess
import sys
import tarfile
import tempfile
import zipfile

import numpy as np

import mutate

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cli"))
LARGEST = 1 << 16  # maximum size of a file, in bytes


def fiji_roi():
    points, n = [(3.5, 4.5), (9.25, 4.5), (9.0, 11.0)], 3
    head = bytearray(64)
    struct.pack_into(">4shB", head, 0, b"Iout", 228, 0)
    struct.pack_into(">H", head, 16, n)
    struct.pack_into(">h", head, 50, 128)
    struct.pack_into(">ii", head, 56, 2, 64 + 12 * n)
    values = [v for axis in zip(*points) for v in axis]
    return bytes(head) + struct.pack(f">{2 * n}h", *map(int, values)) + struct.pack(f">{2 * n}f", *values) + bytes(64)


def las():
    head = bytearray(227)
    struct.pack_into("<4s", head, 0, b"LASF")
    struct.pack_into("<BB", head, 24, 1, 2)
    struct.pack_into("<HIIBHI", head, 94, 227, 227, 0, 0, 20, 5)
    struct.pack_into("<6d", head, 131, 0.01, 0.01, 0.01, 0, 0, 0)
    return bytes(head) + b"".join(struct.pack("<3i", n, 2 * n, n * n) + bytes(8) for n in range(5))


def zarr(text, chunk):
    return text.encode() + b"\0" + chunk


def write_hdf5(path, write):
    import h5py
    with h5py.File(path, "w") as file:
        write(file, np.arange(4 * 5 * 6, dtype="u2").reshape(4, 5, 6))


def imaris(file, values):
    level = file.create_group("DataSet/ResolutionLevel 0/TimePoint 0/Channel 0")
    level.create_dataset("Data", data=values, chunks=(2, 5, 6), compression="gzip")
    letters = lambda text: np.array([c.encode() for c in text], "S1")
    for name, number in zip("XYZ", (6, 5, 4)):
        level.attrs[f"ImageSize{name}"] = letters(str(number))
    info = file.create_group("DataSetInfo/Image")
    for name, text in {"X": "6", "Y": "5", "Z": "4", "ExtMin0": "0", "ExtMin1": "0", "ExtMin2": "0", "ExtMax0": "6", "ExtMax1": "5",
                       "ExtMax2": "4", "Unit": "um"}.items():
        info.attrs[name] = letters(text)


def write_dicom(path, frames, packed):
    import pydicom
    meta = pydicom.dataset.FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = pydicom.uid.CTImageStorage, "1.2.3.1"
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    ds = pydicom.dataset.FileDataset(str(path), {}, file_meta=meta, preamble=b"\0" * 128)
    ds.is_little_endian, ds.is_implicit_VR = True, False
    ds.SOPClassUID, ds.SOPInstanceUID, ds.SeriesInstanceUID = pydicom.uid.CTImageStorage, "1.2.3.1", "1.2.3"
    ds.Modality, ds.NumberOfFrames = "CT", frames
    ds.ImageOrientationPatient, ds.ImagePositionPatient, ds.PixelSpacing = [1, 0, 0, 0, 1, 0], [0, 0, 0], [1, 1]
    ds.Rows, ds.Columns, ds.SamplesPerPixel, ds.PhotometricInterpretation = 4, 4, 1, "MONOCHROME2"
    ds.PixelRepresentation, ds.BitsAllocated, ds.BitsStored, ds.HighBit = 0, 16, 16, 15
    ds.PixelData = np.arange(16 * frames, dtype="<u2").tobytes()
    if packed:
        ds.compress(pydicom.uid.RLELossless, encoding_plugin="pydicom")
    ds.save_as(str(path), write_like_original=False)


def write_contours(path, implicit):
    """A structure set with a ROI, two contours and a keyhole."""
    import pydicom
    write_dicom(path, 1, False)
    ds = pydicom.dcmread(str(path))
    ds.file_meta.TransferSyntaxUID = pydicom.uid.ImplicitVRLittleEndian if implicit else pydicom.uid.ExplicitVRLittleEndian
    ds.is_implicit_VR = implicit
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.481.3"
    del ds.PixelData
    roi, contours = pydicom.Dataset(), pydicom.Dataset()
    roi.ROINumber, roi.ROIName = 1, "a"
    contours.ReferencedROINumber, contours.ContourSequence = 1, pydicom.Sequence()
    for text in ("0 0 1 9 0 1 9 9 1", "0 0 2 9 0 2 9 9 2 0 0 2 3 2 2 5 2 2 5 4 2 3 2 2 0 0 2"):
        contour = pydicom.Dataset()
        contour.ContourGeometricType, contour.ContourData = "CLOSED_PLANAR", text.split()
        contour.NumberOfContourPoints = len(text.split()) // 3
        contours.ContourSequence.append(contour)
    ds.StructureSetROISequence, ds.ROIContourSequence = pydicom.Sequence([roi]), pydicom.Sequence([contours])
    ds.save_as(str(path), write_like_original=False)


def seeds_of(covol, folder):
    """format -> small valid files, a list of bytes."""
    seeds = {end: [path.read_bytes()] for end, path in mutate.seeds_of(covol, folder).items() if path.is_file()}
    seeds["tif"].append(seeds.pop("ome.tif")[0])
    seeds["points.ply"], seeds["image.vdb"] = [(folder / "seed.ply").read_bytes(), seeds["ply"][0]], seeds["vdb"]
    seeds["roi"] = [fiji_roi()]
    with zipfile.ZipFile(folder / "rois.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("0001.roi", fiji_roi())
        archive.writestr("0002.roi", fiji_roi())
    seeds["zip"] = [(folder / "rois.zip").read_bytes()]
    seeds["las"] = [las()]
    pcd = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA "
    seeds["pcd"] = [(pcd + "ascii\n0 0 0\n1 0 0\n0 1 0\n").encode(), (pcd + "binary\n").encode() + struct.pack("<9f", *range(9))]
    seeds["fcsv"] = [b"# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label\n"
                     b"1,1.5,2.5,3.5,0,0,0,1,1,1,0,F-1,,\n2,4,5,6,0,0,0,1,1,1,0,F-2,,\n"]
    seeds["mrk.json"] = [b'{"markups":[{"type":"ClosedCurve","coordinateSystem":"LPS","controlPoints":[{"id":"1","position":[1,2,3]},'
                         b'{"id":"2","position":[4,2,3]},{"id":"3","position":[4,6,3]}]}]}']
    seeds["annot"] = [b"ITK-SNAP Annotation File\nLandmark 1 2 3\n", b"<registry><folder key='A'/></registry>"]
    seeds["xml"] = [b"<?xml version='1.0'?><CellCounter_Marker_File><Marker_Data><Marker_Type><Type>1</Type><Name>a</Name><Marker>"
                    b"<MarkerX>1</MarkerX><MarkerY>2</MarkerY><MarkerZ>3</MarkerZ></Marker></Marker_Type></Marker_Data></CellCounter_Marker_File>"]
    for name, dtype in (("npy", "<u2"), ("npy", ">f4")):
        np.save(folder / "a.npy", np.arange(60).reshape(3, 4, 5).astype(dtype))
        seeds.setdefault(name, []).append((folder / "a.npy").read_bytes())
    head = bytearray(1024)
    struct.pack_into("<4i", head, 0, 5, 4, 3, 1)
    struct.pack_into("<3i", head, 28, 5, 4, 3)
    struct.pack_into("<6f", head, 40, 5, 4, 3, 90, 90, 90)
    struct.pack_into("<3i", head, 64, 1, 2, 3)
    head[208:216] = b"MAP \x44\x44\0\0"
    seeds["mrc"] = [bytes(head) + np.arange(60, dtype="<i2").tobytes()]
    header = ("\t\nics_version\t2.0\nfilename\ta\nlayout\torder\tbits\tx\ty\tz\tch\tt\nlayout\tsizes\t16\t5\t4\t3\t1\t1\n"
              "representation\tformat\tinteger\nrepresentation\tsign\tunsigned\nrepresentation\tcompression\tuncompressed\n"
              "representation\tbyte_order\t1\t2\nparameter\torigin\t0\t1\t2\t3\nparameter\tscale\t1\t0.5\t0.5\t2\n"
              "parameter\tunits\tbits\tum\tum\tnm\nend\n")
    values = np.arange(60, dtype="<u2").tobytes()
    seeds["ics"] = [header.encode() + values, header.replace("uncompressed", "gzip").encode() + gzip.compress(values),
                    # The header alone: in version 1.0 of ICS, the voxels are in another file.
                    header.replace("ics_version\t2.0", "ics_version\t1.0").encode()]
    write_hdf5(folder / "a.h5", lambda file, values: file.create_dataset("data", data=values, chunks=(2, 5, 6), compression="gzip"))
    write_hdf5(folder / "a.ims", imaris)
    for frames, packed in ((2, False), (1, False), (1, True)):
        write_dicom(folder / "a.dcm", frames, packed)
        seeds.setdefault("dcm", []).append((folder / "a.dcm").read_bytes())
    for implicit in (False, True):
        write_contours(folder / "a.dcm", implicit)
        seeds.setdefault("contours.dcm", []).append((folder / "a.dcm").read_bytes())
    for name in ("h5", "ims"):
        seeds[name] = [(folder / f"a.{name}").read_bytes()]
    seeds["zarr"] = [zarr('{"zarr_format":2,"shape":[3,4,5],"chunks":[3,4,5],"dtype":"<u2","compressor":null,"fill_value":0,"order":"C",'
                          '"filters":null}', values)]
    seeds["zarr3"] = [zarr('{"zarr_format":3,"node_type":"array","shape":[3,4,5],"data_type":"uint16","chunk_grid":{"name":"regular",'
                           '"configuration":{"chunk_shape":[3,4,5]}},"chunk_key_encoding":{"name":"default","configuration":{"separator":"/"}},'
                           '"fill_value":0,"codecs":[{"name":"bytes","configuration":{"endian":"little"}}],"attributes":{}}', values)]
    return seeds


def add_kept(seeds, path):
    """The files that previous runs kept: tests/fuzz/corpus.tar.xz."""
    if not path.is_file():
        return
    with tarfile.open(path) as archive:
        for entry in archive.getmembers():
            seeds[entry.name.split("/")[0]].append(archive.extractfile(entry).read())


def run_once(words, environment, work):
    """@return CPU seconds, including its children, and the output"""
    with tempfile.TemporaryFile("w+", errors="replace") as output:
        process = subprocess.Popen(words, env=environment, cwd=work, stdout=subprocess.DEVNULL, stderr=output)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        return usage.ru_utime + usage.ru_stime, output.read()


def fuzz(program, end, seeds, seconds, limit, keep, corpus):
    """@return executions, CPU seconds, edges covered at first and at last, findings (paths)"""
    with tempfile.TemporaryDirectory(prefix="covol-fuzz-") as name:
        work = pathlib.Path(name)
        begin = work / "seeds"
        begin.mkdir()
        for n, data in enumerate(seeds):
            (begin / str(n)).write_bytes(data)
        (known := corpus / end if corpus else work / "corpus").mkdir(parents=True, exist_ok=True)
        (found := work / "found").mkdir()
        largest = max(LARGEST, 2 * max(map(len, seeds)))
        maximum = 64 + 10 * largest // 2**20
        words = [program, known, begin, f"-max_len={largest}", f"-timeout={limit}", "-fork=1", "-ignore_crashes=1", "-ignore_ooms=1",
                 "-ignore_timeouts=1", f"-artifact_prefix={found}/", f"-malloc_limit_mb={maximum}", "-rss_limit_mb=2048"]
        environment = os.environ | {"COVOL_FUZZ_FORMAT": end, "ASAN_OPTIONS": "allocator_may_return_null=0:detect_leaks=0:handle_abort=1",
                                    "UBSAN_OPTIONS": "print_stacktrace=1"}
        executions, computed, covered = 0, 0.0, []
        # Fuzzing continues until the fuzzer has used `seconds` of CPU time: wall clock time depends on the load of the
        # machine.
        while (left := seconds - computed) > 0.02 * seconds:
            took, output = run_once([str(word) for word in [*words, f"-max_total_time={max(1, int(left))}"]], environment, work)
            states = re.findall(r"^#(\d+): cov: (\d+)", output, re.MULTILINE)
            if not states:
                sys.exit(f"{end}: the fuzzer did not run:\n{output[-2000:]}")
            executions, computed = executions + int(states[-1][0]), computed + took
            covered += [int(edges) for _, edges in states]
        # Findings of too much memory or time are repeated in a new process, and dropped if they do not recur: after
        # thousands of damaged files a process holds leaked memory, and a busy machine is slow.
        alone = [program, f"-timeout={limit}", f"-malloc_limit_mb={maximum}", "-rss_limit_mb=512"]
        findings = []
        for path in sorted(found.iterdir()):
            if not path.name.startswith("crash-") and subprocess.run([*alone, path], env=environment, cwd=work, capture_output=True).returncode == 0:
                continue
            keep.mkdir(parents=True, exist_ok=True)
            target = keep / f"{end}-{path.name}"
            target.write_bytes(path.read_bytes())
            findings.append(target)
        return executions, computed, covered[0], covered[-1], findings


def pack(program, seeds, corpus, maximum, target):
    """The smallest files that reach the same edges as the corpus, a limited number for each format, as one archive: tests/cli/corpus_test.py."""
    with tempfile.TemporaryDirectory(prefix="covol-pack-") as name, tarfile.open(target, "w:xz", preset=9 | lzma.PRESET_EXTREME) as archive:
        for end in sorted(seeds):
            (merged := pathlib.Path(name) / end).mkdir()
            (begin := pathlib.Path(name) / f"{end}-seeds").mkdir()
            for n, data in enumerate(seeds[end]):
                (begin / str(n)).write_bytes(data)
            folders = [begin] + [corpus / end] * (corpus / end).is_dir()
            subprocess.run([program, "-merge=1", merged, *folders], env=os.environ | {"COVOL_FUZZ_FORMAT": end}, cwd=name, check=True,
                           capture_output=True)
            for n, path in enumerate(sorted(merged.iterdir(), key=lambda path: (path.stat().st_size, path.name))[:maximum]):
                entry = tarfile.TarInfo(f"{end}/{n:03}")
                entry.size = path.stat().st_size
                archive.addfile(entry, io.BytesIO(path.read_bytes()))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", type=pathlib.Path, required=True, help="covol_fuzz_readers")
    parser.add_argument("--covol", required=True, help="makes the first files")
    parser.add_argument("--seconds", type=float, default=1800, help="of computing, for each format")
    parser.add_argument("--formats", default="", help="some of them, by commas")
    parser.add_argument("--limit", type=int, default=20, help="seconds that one file may take")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("fuzz-findings"))
    parser.add_argument("--corpus", type=pathlib.Path)
    parser.add_argument("--pack", type=pathlib.Path, help="fuzz nothing: make this .tar.xz of the best files of --corpus")
    parser.add_argument("--pack-max", type=int, default=60, help="files of a format")
    options = parser.parse_args()
    found = []
    with tempfile.TemporaryDirectory(prefix="covol-seeds-") as name:
        seeds = seeds_of(os.path.abspath(options.covol), pathlib.Path(name))
        add_kept(seeds, HERE / "corpus.tar.xz")
        if options.pack:
            return pack(options.program.resolve(), seeds, options.corpus.resolve(), options.pack_max, options.pack)
        chosen = options.formats.split(",") if options.formats else sorted(seeds)
        if unknown := set(chosen) - set(seeds):
            parser.error(f"--formats: no reader for {', '.join(sorted(unknown))}; there are {', '.join(sorted(seeds))}")
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            running = {pool.submit(fuzz, options.program.resolve(), end, seeds[end], options.seconds, options.limit,
                                   options.keep.resolve(), options.corpus and options.corpus.resolve()): end for end in chosen}
            for result in concurrent.futures.as_completed(running):
                executions, computed, first, last, findings = result.result()
                print(f"{running[result]}: {executions} executions in {computed / 60:.1f} minutes of computing, {first} to {last} edges, "
                      f"{len(findings)} findings", flush=True)
                found += findings
    print("\n".join(map(str, found)) if found else "no finding")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
