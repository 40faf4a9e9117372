"""Decode a video and check that its frames show lit, moving bodies."""

import argparse
import sys

import av
import numpy as np


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("video")
    parser.add_argument("--frames", type=int, required=True)
    parser.add_argument("--size", required=True)
    options = parser.parse_args()
    with av.open(options.video) as container:
        images = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    height, width = images[0].shape[:2]
    print(f"{len(images)} frames of {width}x{height}")
    assert f"{width}x{height}" == options.size, "the size is wrong"
    assert len(images) == options.frames, "the number of frames is wrong"
    first, last = images[0].astype(float), images[-1].astype(float)
    saturation = last.max(axis=2) - last.min(axis=2)
    assert (saturation > 60).mean() > 0.01, "no coloured body is seen"
    assert np.ptp(last.mean(axis=2)) > 100, "nothing is lit or shaded"
    assert (np.abs(last - first).max(axis=2) > 40).mean() > 0.01, "nothing has moved"
    return 0


if __name__ == "__main__":
    sys.exit(main())
