#!/usr/bin/env python3
"""pca_features.py: features of a sequence through a learner's hands: the nearest poses of a linear model of few numbers.

    vg-encode walk.zip | vg-features | vg-decode --f64 -o walk.npz
    python3 pca_features.py 8 walk.npz few.npz     8 principal components; NumPy is needed
    vg-encode few.npz | vg-solve -o few.vgs

All arrays but the features go through as they are: faces, reference, names, times, root_turns, centroids.
As many components as frames, less one, give the sequence back.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import sys

import numpy as np


def nearest(features: np.ndarray, components: int) -> np.ndarray:
    """Each frame's nearest point in the space of the first principal components."""
    rows = features.reshape(len(features), -1).astype(np.float64)
    mean = rows.mean(axis=0)
    _, _, axes = np.linalg.svd(rows - mean, full_matrices=False)
    axes = axes[:components]
    return (mean + (rows - mean) @ axes.T @ axes).reshape(features.shape)


def main() -> int:
    if len(sys.argv) != 4 or not sys.argv[1].isdigit():
        print("usage: pca_features.py COMPONENTS IN.npz OUT.npz", file=sys.stderr)
        return 2
    arrays = dict(np.load(sys.argv[2]))
    arrays["features"] = nearest(arrays["features"], int(sys.argv[1]))
    np.savez(sys.argv[3], **arrays)
    return 0


if __name__ == "__main__":
    sys.exit(main())
