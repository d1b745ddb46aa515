"""Fixed work that calibrates a machine, the least CPU seconds of some calls each; prints JSON [[what, seconds], ...]."""
import json
import time

from mpfe_files import np


def least_seconds(work, repeat):
    seconds = []
    for _ in range(repeat):
        begin = time.process_time()
        work()
        seconds.append(time.process_time() - begin)
    return min(seconds)


def factorise(m=300):
    """Laplacian on m x m nodes by block rows: D(k+1) = B - D(k)^-1; the last block by Cholesky."""
    block = 4.0 * np.eye(m) - np.eye(m, k=1) - np.eye(m, k=-1)
    d = block
    for _ in range(m - 1):
        d = block - np.linalg.inv(d)
    return np.linalg.cholesky(d)


a = np.cos(np.arange(1e6)).reshape(1000, 1000)
x = np.linspace(0.0, 1.0, 4000000)
print(json.dumps([
    ["product of two dense matrices, 1000 x 1000 (numpy)", least_seconds(lambda: a @ a, 7)],
    ["sparse factorisation: Laplacian on 300 x 300 nodes, by block rows (numpy)", least_seconds(factorise, 3)],
    ["sum of two vectors of 4 million numbers, ten times", least_seconds(lambda: [x + x for _ in range(10)], 5)]]))
