"""OpenCV's ORB and SIFT as rivals in `deepsft-lab study finding --opencv`: matches of a print in a frame after a
homography and a smooth warp.

    python opencv_matches.py ORB|SIFT

reads a line of JSON at a time from standard input and answers each with a line of JSON:

    {"target": FILE, "width": W, "height": H, "rest": [X, Y]}   a print of X x Y mm: RGB bytes, row-major
    {"frame": FILE, "width": W, "height": H}                    a frame: the same

The second gives `matches`, one [x, y, place x, place y, angle, scale] each: pixels, mm on the print, the angle by which the
warp turns directions of the image, and mm per pixel. DEEPSFT_BENCH_THREADS says on how many threads."""

import json
import math
import os
import sys
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[variable] = os.environ["DEEPSFT_BENCH_THREADS"]

import cv2  # noqa: E402
import numpy as np  # noqa: E402

cv2.setNumThreads(int(os.environ["DEEPSFT_BENCH_THREADS"]))

# Corners of a frame and of a print.
CORNERS = 4000
# Longer side of the picture of a print that corners are taken from, pixels: as for our finder.
PRINT_PX = 640
# ORB: of this many nearest descriptors the second best is the first whose place is farther than ELSEWHERE_MM.
NEIGHBOURS = 16
ELSEWHERE_MM = 6.0
ORB_RATIO = 0.9
MOST_BITS = 64
# SIFT: Lowe's ratio test.
SIFT_RATIO = 0.8
# Tolerances in mm: of the homography, the better is taken, then of the warp, one after the other.
HOMOGRAPHY_MM = (30.0, 12.0)
WARP_MM = (25.0, 15.0, 10.0, 8.0)
# The warp reaches this far beyond the matches of the homography, pixels.
MARGIN_PX = 30.0
# Nodes of the warp, and the weight of its second differences beside 1 for a match.
COLUMNS, ROWS = 7, 5
SMOOTHNESS = 4.0
# Fewest matches of a homography and of a warp.
FEWEST = 8


class Orb:
    def __init__(self):
        self.detector = cv2.ORB_create(nfeatures=CORNERS, fastThreshold=8)
        self.matcher = cv2.BFMatcher(cv2.NORM_HAMMING)

    def pairs(self, descriptors, others, places):
        """Indices into the frame's and the print's corners, and how clear each pair is, less is clearer."""
        pairs, ratios = [], []
        for found in self.matcher.knnMatch(descriptors, others, k=NEIGHBOURS):
            best = found[0]
            place = places[best.trainIdx]
            away = (m for m in found[1:] if math.dist(places[m.trainIdx], place) > ELSEWHERE_MM)
            # Where all are at one place, one elsewhere is no nearer than the last.
            second = next(away, None)
            ratio = best.distance / max((second or found[-1]).distance, 1.0)
            if best.distance < MOST_BITS and (second is None or ratio < ORB_RATIO):
                pairs.append((best.queryIdx, best.trainIdx))
                ratios.append(ratio)
        return pairs, ratios


class Sift:
    def __init__(self):
        self.detector = cv2.SIFT_create(nfeatures=CORNERS)

    def pairs(self, descriptors, others, _places):
        squares = (descriptors**2).sum(1)[:, None] + (others**2).sum(1) - 2 * descriptors @ others.T
        best = squares.argmin(1)
        rows = np.arange(len(squares))
        least = np.sqrt(np.maximum(squares[rows, best], 0))
        squares[rows, best] = np.inf
        second = np.sqrt(np.maximum(squares.min(1), 1e-9))
        ratios = least / second
        kept = np.flatnonzero(ratios < SIFT_RATIO)
        return [(i, best[i]) for i in kept], ratios[kept].tolist()


class Warp:
    """A smooth map from pixels to mm: bilinear between 7 x 5 nodes over the matches, with small second differences."""

    def __init__(self, low, high):
        self.low = low
        self.cell = np.maximum(high - low, 1.0) / (COLUMNS - 1, ROWS - 1)
        self.nodes = None
        differences = []
        for row in range(ROWS):
            for column in range(COLUMNS):
                at = row * COLUMNS + column
                for step, inside in ((1, 0 < column < COLUMNS - 1), (COLUMNS, 0 < row < ROWS - 1)):
                    if inside:
                        line = np.zeros(COLUMNS * ROWS)
                        line[[at - step, at, at + step]] = 1, -2, 1
                        differences.append(line)
                if column < COLUMNS - 1 and row < ROWS - 1:
                    line = np.zeros(COLUMNS * ROWS)
                    line[[at, at + 1, at + COLUMNS, at + COLUMNS + 1]] = 1, -1, -1, 1
                    differences.append(np.sqrt(2) * line)
        differences = np.array(differences)
        self.stiffness = SMOOTHNESS * differences.T @ differences

    def weights(self, pixels):
        """Per pixel the four nodes and their weights, and the derivatives of these by x and y."""
        at = (pixels - self.low) / self.cell
        first = np.clip(np.floor(at), 0, (COLUMNS - 2, ROWS - 2)).astype(int)
        (x, y), index = (at - first).T, first[:, 1] * COLUMNS + first[:, 0]
        nodes = index[:, None] + np.array([0, 1, COLUMNS, COLUMNS + 1])
        values = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], 1)
        by_x = np.stack([y - 1, 1 - y, -y, y], 1) / self.cell[0]
        by_y = np.stack([x - 1, -x, 1 - x, x], 1) / self.cell[1]
        return nodes, values, by_x, by_y

    def fit(self, pixels, places):
        nodes, values, _, _ = self.weights(pixels)
        matrix = np.zeros((len(pixels), COLUMNS * ROWS))
        np.put_along_axis(matrix, nodes, values, 1)
        self.nodes = np.linalg.solve(matrix.T @ matrix + self.stiffness, matrix.T @ places)

    def places(self, pixels):
        nodes, values, _, _ = self.weights(pixels)
        return np.einsum("nk,nkc->nc", values, self.nodes[nodes])

    def angles_and_scales(self, pixels):
        nodes, _, by_x, by_y = self.weights(pixels)
        x, y = (np.einsum("nk,nkc->nc", by, self.nodes[nodes]) for by in (by_x, by_y))
        determinants = x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]
        return np.arctan2(x[:, 1] - y[:, 0], x[:, 0] + y[:, 1]), np.sqrt(np.abs(determinants))


def warped(pixels, places, kept):
    """Indices of the matches that a warp explains which starts from those in `kept`, and the warp; `None` if too few."""
    low, high = pixels[kept].min(0) - MARGIN_PX, pixels[kept].max(0) + MARGIN_PX
    inside = ((pixels > low) & (pixels < high)).all(1)
    warp = Warp(low, high)
    for tolerance in WARP_MM:
        warp.fit(pixels[kept], places[kept])
        off = np.linalg.norm(warp.places(pixels) - places, axis=1)
        kept = np.flatnonzero(inside & (off < tolerance))
        if len(kept) < FEWEST:
            return None
    return kept, warp


def inliers(pixels, places):
    """The same from a homography: the tolerance whose warp explains more."""
    found = []
    for tolerance in HOMOGRAPHY_MM:
        matrix, mask = cv2.findHomography(pixels, places, cv2.RANSAC, tolerance, maxIters=3000)
        if matrix is not None and mask.sum() >= FEWEST:
            found.append(warped(pixels, places, np.flatnonzero(mask.ravel())))
    return max(filter(None, found), key=lambda result: len(result[0]), default=None)


class Finder:
    def __init__(self, method):
        self.method = method
        self.places, self.descriptors = np.zeros((0, 2)), None

    def take(self, grey, size_mm):
        scale = PRINT_PX / max(grey.shape)
        if scale < 1:
            grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        mm = np.array(size_mm) / grey.shape[::-1]
        corners, self.descriptors = self.method.detector.detectAndCompute(grey, None)
        self.places = np.array([(np.array(c.pt) + 0.5) * mm for c in corners]).reshape(-1, 2)

    def find(self, grey):
        corners, descriptors = self.method.detector.detectAndCompute(grey, None)
        if len(self.places) <= NEIGHBOURS or len(corners) < FEWEST:
            return None
        pairs, ratios = self.method.pairs(descriptors, self.descriptors, self.places)
        if len(pairs) < FEWEST:
            return None
        pairs = np.array(pairs)[np.argsort(ratios)]
        pixels = np.array([corners[i].pt for i in pairs[:, 0]]) + 0.5
        places = self.places[pairs[:, 1]]
        found = inliers(pixels, places)
        if found is None:
            return None
        kept, warp = found
        angles, scales = warp.angles_and_scales(pixels[kept])
        return np.column_stack([pixels[kept], places[kept], angles, scales]), warp


def main():
    finder = Finder({"ORB": Orb, "SIFT": Sift}[sys.argv[1]]())
    for line in sys.stdin:
        request = json.loads(line)
        size = request["height"], request["width"], 3
        name = request.get("target") or request["frame"]
        grey = cv2.cvtColor(np.fromfile(name, np.uint8).reshape(size), cv2.COLOR_RGB2GRAY)
        start = time.process_time()
        answer = {}
        if "target" in request:
            finder.take(grey, request["rest"])
        elif found := finder.find(grey):
            matches, warp = found
            answer["matches"] = np.round(matches, 4).tolist()
            answer["warp"] = {"low": warp.low.tolist(), "cell": warp.cell.tolist(), "nodes": warp.nodes.tolist()}
        answer["milliseconds"] = 1e3 * (time.process_time() - start)
        print(json.dumps(answer), flush=True)


main()
