"""A common approach in Python: OpenCV's MOG2 background model and connected components, frame by frame.

    opencv_loop.py FILM

Prints centroid and area of the largest component of each frame as CSV.
"""

import sys

import cv2

film = cv2.VideoCapture(sys.argv[1])
model = cv2.createBackgroundSubtractorMOG2(detectShadows=True)
kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
while True:
    there, frame = film.read()
    if not there:
        break
    mask = (model.apply(frame) == 255).astype("uint8")
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, kernel)
    n, _, stats, centroids = cv2.connectedComponentsWithStats(mask)
    if n > 1:
        best = 1 + stats[1:, cv2.CC_STAT_AREA].argmax()
        print(*centroids[best], stats[best, cv2.CC_STAT_AREA], sep=",")
