"""The sums of m^2, m^2 r and m r r^T over the points of a file: one matrix product a block.

python points.py CLOUD.npy
"""

import sys

import numpy as np

BLOCK = 65_536

points = np.load(sys.argv[1], mmap_mode="r")
total = np.zeros((4, 4))
for start in range(0, len(points), BLOCK):
    block = points[start : start + BLOCK]
    total += block.T @ (block[:, :1] * block)
print(total)
