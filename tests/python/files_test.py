"""Untrusted files are read in a separate program of covol, whatever this process does meanwhile."""
import pathlib
import shutil
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import covol

SHAPE = (4, 5, 6)


def write_nrrd(path, array):
    sizes = " ".join(str(n) for n in array.shape[::-1])
    path.write_text(f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {sizes}\nspacings: 1 1 1\nencoding: ascii\n\n"
                    + " ".join(map(str, array.ravel())) + "\n")


def write_hdf5(path, array):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("voxels", data=array, chunks=array.shape, compression="gzip")


def write_dicom(folder, array):
    """A series whose slices are compressed, which GDCM decodes."""
    pydicom = pytest.importorskip("pydicom")
    from pydicom.dataset import FileDataset, FileMetaDataset
    from pydicom.uid import ExplicitVRLittleEndian, RLELossless, generate_uid
    folder.mkdir()
    series = generate_uid()
    for k, plane in enumerate(array):
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.2", generate_uid()
        meta.TransferSyntaxUID = ExplicitVRLittleEndian
        data = FileDataset(str(folder / f"{k}.dcm"), {}, file_meta=meta, preamble=bytes(128))
        data.is_little_endian, data.is_implicit_VR = True, False
        data.SOPClassUID, data.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        data.SeriesInstanceUID, data.Modality = series, "CT"
        data.Rows, data.Columns, data.SamplesPerPixel, data.PhotometricInterpretation = *plane.shape, 1, "MONOCHROME2"
        data.BitsAllocated = data.BitsStored = 8
        data.HighBit, data.PixelRepresentation = 7, 0
        data.PixelSpacing, data.ImageOrientationPatient = [1, 1], [1, 0, 0, 0, 1, 0]
        data.ImagePositionPatient = [0, 0, k]
        data.PixelData = plane.tobytes()
        data.compress(RLELossless, encoding_plugin="pydicom")
        data.save_as(folder / f"{k}.dcm", write_like_original=False)


def test_busy_threads_stall_no_reader(tmp_path):
    """A forked copy of a process would wait forever for a lock that another thread holds, such as malloc's."""
    array = np.random.default_rng(1).integers(0, 200, SHAPE).astype(np.uint8)
    files = [tmp_path / "ascii.nrrd", tmp_path / "series", tmp_path / "voxels.h5"]
    for path, write in zip(files, (write_nrrd, write_dicom, write_hdf5)):
        write(path, array)
    done = threading.Event()

    def work():
        while not done.is_set():
            np.sort(np.random.default_rng(2).random(20000))  # NumPy releases the GIL here, so that threads switch often
            "".join(str(n) for n in range(500))

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    slowest = 0.0
    try:
        for n in range(200):
            begin = time.monotonic()
            image = covol.read_image(files[n % 3])
            slowest = max(slowest, time.monotonic() - begin)
            np.testing.assert_array_equal(image.array, array)
    finally:
        done.set()
        for thread in threads:
            thread.join()
    assert slowest < 50  # seconds; a reader that is blocked by a deadlock is ended after 100 s, others take at most one


def test_a_module_without_its_compiled_part_states_how_to_build_it(tmp_path):
    """As in the folder of a build of the program alone."""
    (tmp_path / "covol").mkdir()
    for file in pathlib.Path(covol.__file__).parent.glob("*.py"):
        shutil.copy(file, tmp_path / "covol")
    done = subprocess.run([sys.executable, "-c", "import covol"], capture_output=True, text=True,
                          env={"PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"})
    assert done.returncode != 0
    assert "--target covol_python" in done.stderr and "partially initialized" not in done.stderr
